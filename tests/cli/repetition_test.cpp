#include "cli/repetition.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/excitation_phase.hpp"
#include "tests/sanitized.hpp"

namespace shaker::cli {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr std::size_t kPoints = 32;

// A motion of amplitude 1 with a subharmonic of `share` over `periods`, and white noise.
Cycles motion(int count, int periods, double share, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  Cycles cycles{{}, kPoints};
  for (std::size_t i = 0; i < kPoints * static_cast<std::size_t>(count); ++i) {
    const double tau = static_cast<double>(i) / static_cast<double>(kPoints);
    cycles.y.push_back(std::cos(kTurn * tau) + share * std::cos(kTurn * tau / periods) +
                       noise * normal(random));
  }
  return cycles;
}

TEST(Repetition, ScatterIsTheNoiseWhereItRepeatsAndTheMotionsElsewhere) {
  const Cycles cycles = motion(200, 2, 0.1, 0.01, 1);
  EXPECT_NEAR(scatter_after(cycles, 2), 0.01, 3e-4);
  EXPECT_NEAR(scatter_after(cycles, 4), 0.01, 3e-4);
  EXPECT_NEAR(scatter_after(cycles, 1), std::hypot(0.01, 0.1 / std::numbers::sqrt2), 1e-3);
  EXPECT_TRUE(std::isinf(scatter_after(motion(5, 2, 0.1, 0.01, 1), 3)));
}

TEST(Repetition, NoNoiseIsTakenForASubharmonic) {
  for (unsigned seed = 0; seed < 500; ++seed) {
    const int count = 4 + static_cast<int>(seed % 40);
    const auto doubt = doubt_of_repetition(motion(count, 1, 0.0, 0.01, seed), "f");
    EXPECT_EQ(doubt.sentence, "") << seed;
  }
  EXPECT_EQ(doubt_of_repetition(motion(20, 1, 0.0, 0.0, 1), "f").sentence, "");
}

// The offset changes from cycle to cycle. A cycle then has one independent value, and few
// cycles may alternate by chance.
TEST(Repetition, AWanderIsSeldomTakenForASubharmonic) {
  int doubted = 0;
  constexpr int kRecords = kSanitized ? 1000 : 4000;
  for (unsigned seed = 0; seed < kRecords; ++seed) {
    Cycles cycles = motion(4 + static_cast<int>(seed % 12), 1, 0.0, 1e-3, seed);
    std::mt19937 random(seed + 77);
    std::normal_distribution<double> offset(0.0, 0.03);
    for (std::size_t c = 0; c < cycles.count(); ++c) {
      const double moved = offset(random);
      for (std::size_t i = 0; i < kPoints; ++i)
        cycles.y[c * kPoints + i] += moved;
    }
    doubted += doubt_of_repetition(cycles, "f").sentence.empty() ? 0 : 1;
  }
  EXPECT_LE(doubted, 3 * kRecords / 1000);  // one in a thousand for each of 2, 3 and 4 periods
}

TEST(Repetition, SubharmonicsAreNamedWithTheirPeriodAndTheirSize) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    // The means of odd and even cycles differ by twice the subharmonic; its rms difference is
    // 0.1 sqrt 2.
    const auto two = doubt_of_repetition(motion(200, 2, 0.1, 0.01, seed), "f");
    EXPECT_THAT(two.sentence, testing::HasSubstr("odd and even ones differ by 10 times the noise"));
    EXPECT_TRUE(two.spoils);
    EXPECT_THAT(doubt_of_repetition(motion(24, 3, 0.1, 0.01, seed), "f", "r01").sentence,
                testing::HasSubstr("say --periods r01=3"));
    EXPECT_THAT(doubt_of_repetition(motion(24, 4, 0.1, 0.01, seed), "f").sentence,
                testing::HasSubstr("no more than 3 periods can be fitted"));
    EXPECT_TRUE(check_repetition(motion(24, 2, 0.1, 0.01, seed), 2, "f"));
    EXPECT_TRUE(check_repetition(motion(24, 3, 0.1, 0.01, seed), 3, "f"));
    // A subharmonic below the noise of a cycle is found too.
    EXPECT_TRUE(check_repetition(motion(40, 2, 0.008, 0.01, seed), 2, "f")) << seed;
  }
  EXPECT_FALSE(doubt_of_repetition(motion(24, 2, 0.01, 0.001, 1), "f").spoils);
}

TEST(ExcitationPhase, TellsTheFrequencyOfANoisyRecord) {
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0.0, 0.02);
  std::vector<double> t, x;
  for (int i = 0; i < 5000; ++i) {
    t.push_back(0.37 + i / 733.0);
    x.push_back(0.5 + std::cos(kTurn * 4.002 * t.back() - 1.0) + noise(random));
  }
  const PhaseDrift drift = phase_drift(t, x, 4.0);
  EXPECT_NEAR(drift.frequency_hz, 4.002, 1e-4);
  EXPECT_NEAR(drift.turns, 0.002 / 4.0 * 26.0, 1e-3);
  EXPECT_LT(std::fabs(phase_drift(t, x, 4.002).turns), 1e-3);
  EXPECT_EQ(phase_drift({0.0, 0.1, 0.2}, {0.0, 1.0, 0.0}, 4.0).turns, 0.0);
}

}  // namespace
}  // namespace shaker::cli
