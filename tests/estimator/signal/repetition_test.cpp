#include "estimator/signal/repetition.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "tests/estimator/signal/repeating_motion.hpp"

namespace shaker::estimator {
namespace {

using testing::kPoints;
using testing::kTurn;
using testing::motion;

TEST(Repetition, ScatterIsTheNoiseWhereItRepeatsAndTheMotionsElsewhere) {
  const Cycles cycles = motion(200, 2, 0.1, 0.01, 1);
  EXPECT_NEAR(scatter_after(cycles, 2), 0.01, 3e-4);
  EXPECT_NEAR(scatter_after(cycles, 4), 0.01, 3e-4);
  EXPECT_NEAR(scatter_after(cycles, 1), std::hypot(0.01, 0.1 / std::numbers::sqrt2), 1e-3);
  EXPECT_TRUE(std::isinf(scatter_after(motion(5, 2, 0.1, 0.01, 1), 3)));
}

TEST(Repetition, TellsWhatARecordDoesInstead) {
  const auto kind = [](const Cycles& cycles, int periods) {
    return find_repetition(cycles, periods).kind;
  };
  for (unsigned seed = 0; seed < 50; ++seed) {
    EXPECT_EQ(kind(motion(24, 2, 0.1, 0.01, seed), 2), Repetition::repeats);
    EXPECT_EQ(kind(motion(24, 1, 0.0, 0.01, seed), 2), Repetition::every_period);
    const RepetitionFinding other = find_repetition(motion(24, 2, 0.1, 0.01, seed), 3);
    EXPECT_EQ(other.kind, Repetition::other_period);
    EXPECT_EQ(other.best, 2);
    EXPECT_NEAR(other.best_scatter, 0.01, 2e-3);
  }
  EXPECT_EQ(kind(motion(3, 2, 0.1, 0.01, 1), 2), Repetition::too_few);
  Cycles torus = motion(40, 2, 0.1, 1e-3, 1), settling = torus;
  for (std::size_t i = 0; i < torus.y.size(); ++i) {
    const double tau = static_cast<double>(i) / static_cast<double>(kPoints);
    torus.y[i] += 0.1 * std::cos(kTurn * 0.618 * tau);
    settling.y[i] += 0.2 * std::exp(-tau / 4.0);
  }
  EXPECT_EQ(kind(torus, 2), Repetition::never);
  EXPECT_EQ(kind(settling, 2), Repetition::settles);
}

TEST(Repetition, SteadyCyclesBeginWhereTheTransientIsBelowTheNoise) {
  EXPECT_EQ(steady_groups(motion(4, 1, 0.0, 0.01, 1), 1).count(), 4U);
  EXPECT_EQ(steady_groups(motion(11, 2, 0.5, 0.01, 1), 2).count(), 10U);  // from an odd cycle on
  int late = 0;  // by the noise of one cycle; two more are spared, where a transient may go on
  for (unsigned seed = 0; seed < 50; ++seed) {
    Cycles cycles = motion(20, 1, 0.0, 0.01, seed);
    for (std::size_t i = 0; i < 5 * kPoints; ++i)
      cycles.y[i] += 0.1;
    const std::size_t steady = steady_groups(cycles, 1).count();
    EXPECT_LE(steady, 15U) << seed;
    late += steady < 13 ? 1 : 0;
  }
  EXPECT_LE(late, 1);
}

}  // namespace
}  // namespace shaker::estimator
