#include "estimator/solve/periodic/internal/sweep.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using testing::kOleoFeet;

// Job J5: 200 frequencies from 0.5 to 8 Hz.
TEST(FrequencySweep, FindsTheReferencesSolutionsFromHalfAHertzToEight) {
  const auto reference = testing::read_csv("oleo_j5_reference.csv", false);
  std::vector<double> frequencies;
  for (const auto& row : reference)
    frequencies.push_back(row[0]);
  const Model model(testing::oleo(32.2));
  for (const auto& [points, bound] : {std::pair{120, 2e-7}, std::pair{240, 4e-9}}) {
    SweepOptions options;
    options.grid.points = points;
    FrequencySweep sweep(model, options);
    ASSERT_EQ(sweep.run(kOleoFeet, 10.0, frequencies), 200U);
    double worst = 0.0;
    for (std::size_t f = 0; f < 200; ++f) {
      for (std::size_t i = 0; i < 40; ++i)
        worst =
            std::max(worst, std::fabs(sweep.solution(f)[i * static_cast<std::size_t>(points) / 40] -
                                      reference[f][1 + i]));
    }
    EXPECT_LT(worst, bound);
    EXPECT_LT(sweep.steps(), 120);  // with eight lanes; one lane alone needs about 400
  }
}

std::vector<double> frequencies(double from, double to, int count) {
  std::vector<double> f;
  for (int i = 0; i < count; ++i)
    f.push_back(from + (to - from) * i / (count - 1));
  return f;
}

double amplitude(std::span<const double> z) {
  const auto [low, high] = std::minmax_element(z.begin(), z.end());
  return 0.5 * (*high - *low);
}

// A hardening spring has two stable motions in a band of frequencies. A sweep upwards stays on
// the high one until it ends, a sweep downwards on the low one. A batch of eight sections must
// give the same as one system from frequency to frequency.
TEST(FrequencySweep, StaysOnTheBranchThatItCameBy) {
  const Model model(testing::duffing());
  const std::vector<double> theta = {0.05, 1.0, 0.1};
  const double two_pi = 2.0 * 3.14159265358979323846;
  auto f = frequencies(0.9 / two_pi, 1.6 / two_pi, 71);
  FrequencySweep batch(model, {{Scheme::order6, 64, true}, 1e-9});
  FrequencySweep alone(model, {{Scheme::fourier, 33, false}, 1e-9});
  const std::size_t here = 30;  // 1.2 rad/s: inside the band
  double heights[2];
  for (int way = 0; way < 2; ++way) {
    ASSERT_EQ(batch.run(theta, 0.18, f), f.size());
    ASSERT_EQ(alone.run(theta, 0.18, f), f.size());
    const std::size_t at = way == 0 ? here : f.size() - 1 - here;
    heights[way] = amplitude(batch.solution(at));
    for (const std::size_t i : {std::size_t{0}, at / 2, at})
      EXPECT_NEAR(amplitude(batch.solution(i)), amplitude(alone.solution(i)),
                  0.01 * amplitude(alone.solution(i)))
          << way << ' ' << i;
    std::reverse(f.begin(), f.end());
  }
  EXPECT_GT(heights[0], 1.5 * heights[1]);
}

TEST(FrequencySweep, TakesModelsThatCannotGoAbreast) {
  config::ModelSpec spec = testing::oleo_on_tyre(0.1);
  const Model model(spec);
  FrequencySweep sweep(model, {{Scheme::order6, 96, true}, 1e-9});
  const auto f = frequencies(1.5, 3.0, 7);
  const std::vector<double> theta = model.start();
  ASSERT_EQ(sweep.run(theta, 2.0, f), f.size());
  PeriodicSystem single(model, {Scheme::order6, 96, true});
  single.set_excitation(f[4], 2.0);
  ASSERT_EQ(single.solve_from_rest(theta).status, SolveStatus::converged);
  for (std::size_t i = 0; i < single.state().size(); ++i)
    EXPECT_NEAR(sweep.solution(4)[i], single.state()[i], 1e-8);
}

TEST(FrequencySweep, SaysWhichFrequenciesHaveNoSolution) {
  const Model model(testing::oleo(32.2));
  FrequencySweep sweep(model, {{Scheme::order6, 80, true}, 1e-9});
  const auto f = frequencies(1.0, 3.0, 9);
  EXPECT_EQ(sweep.run(kOleoFeet, 10.0, f), f.size());
  // Half of the gas's stiffness cannot carry the mass: there is no equilibrium.
  std::vector<double> weak = kOleoFeet;
  weak[1] = 1e-9;
  weak[3] = 0.1;
  EXPECT_LT(sweep.run(weak, 10.0, f), f.size());
  EXPECT_NE(sweep.status(0), SolveStatus::converged);
}

TEST(FrequencySweep, RefusesFrequenciesOutOfOrder) {
  const Model model(testing::oleo(32.2));
  FrequencySweep sweep(model);
  for (const std::vector<double>& f :
       {std::vector<double>{1.0, 2.0, 1.5}, std::vector<double>{1.0, 1.0}, std::vector<double>{0.0},
        std::vector<double>{-1.0, 1.0}})
    EXPECT_THROW(sweep.run(kOleoFeet, 10.0, f), std::invalid_argument);
}

}  // namespace
}  // namespace shaker::estimator
