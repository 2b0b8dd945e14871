#include "estimator/fit/several_starts.hpp"

#include <random>

#include <gtest/gtest.h>

#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

// 40 points of the oleo's solution on a fine Fourier grid, with noise.
RunData measured_oleo() {
  const Model model(testing::oleo());
  PeriodicSystem system(model, {Scheme::fourier, 200, false});
  system.set_excitation(2.0, 3.048);
  EXPECT_EQ(system.solve_from_rest(testing::kOleoSi).status, SolveStatus::converged);
  RunData run;
  run.frequency_hz = 2.0;
  run.amplitude = 3.048;
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0.0, 2e-4);
  for (int i = 0; i < 40; ++i)
    run.displacement.push_back(system.value(5 * i, model.observed()) + normal(random));
  return run;
}

EstimationOptions coarse() {
  EstimationOptions options;
  options.grid = {Scheme::order6, 80, true};
  return options;
}

TEST(SeveralStarts, CureTheStartThatEndsWhereNothingMoves) {
  const Model model(testing::oleo());
  const std::vector<double> bad = {0.33, 18.3, 0.66, 1.05};
  const RunData run = measured_oleo();
  EstimationOptions damped = coarse();
  damped.method = Method::levenberg_marquardt;
  const double alone = Estimator(model, {run}, damped).fit(bad).sum_of_squares;
  EXPECT_GT(alone, 1e-4);  // a local minimum: the amplitude is wrong
  const Minima minima = several_starts(model, {run}, coarse(), bad, {});
  ASSERT_FALSE(minima.found.empty());
  const Minimum& best = minima.found.front();
  EXPECT_EQ(best.status, FitStatus::converged);
  EXPECT_NEAR(best.sum_of_squares, 36 * 4e-8, 15 * 4e-8);
  EXPECT_NEAR(best.theta[1], testing::kOleoSi[1], 0.1);
  EXPECT_NEAR(best.theta[2], testing::kOleoSi[2], 0.1);
  EXPECT_GE(minima.found.size(), 2U) << "the valley is reported as well";
}

TEST(SeveralStarts, AreTheSameForTheSameSeedAndInsideTheBounds) {
  const Model model(testing::oleo());
  const std::vector<double> start = {15.0, 1.4, 5.0, 1.1};
  StartOptions few;
  few.starts = 3;
  few.looks = 16;
  const Minima a = several_starts(model, {measured_oleo()}, coarse(), start, few);
  const Minima b = several_starts(model, {measured_oleo()}, coarse(), start, few);
  EXPECT_EQ(a.looks, 48);
  std::size_t fits = 0;
  ASSERT_EQ(a.found.size(), b.found.size());
  for (std::size_t m = 0; m < a.found.size(); ++m) {
    EXPECT_EQ(a.found[m].from, b.found[m].from);
    fits += a.found[m].from.size();
    for (const auto& from : a.found[m].from) {
      for (std::size_t k = 0; k < from.size(); ++k) {
        EXPECT_GE(from[k], model.parameters()[k].lower);
        EXPECT_LE(from[k], model.parameters()[k].upper);
      }
    }
  }
  EXPECT_EQ(fits, 3U);
  few.seed = 2;
  const Minima c = several_starts(model, {measured_oleo()}, coarse(), start, few);
  EXPECT_NE(a.found.front().from, c.found.front().from);
}

}  // namespace
}  // namespace shaker::estimator
