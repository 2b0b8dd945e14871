#include <gtest/gtest.h>

#include "estimator/ceres_estimation.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

TEST(CeresEstimator, EndsAtTheSameOptimum) {
  const Model model(testing::oleo(32.2));
  RunData run;
  run.frequency_hz = 2.0;
  run.amplitude = 10.0;
  for (const auto& row : testing::read_csv("oleo_j1.csv"))
    run.displacement.push_back(row[1]);
  const std::vector<double> start = {5.334, 5.25, 1.701, 1.05};
  CeresEstimator ceres(model, {run});
  Estimator own(model, {run});
  const CeresFit theirs = ceres.fit(start);
  const Fit& ours = own.fit(start);
  ASSERT_TRUE(theirs.converged);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(theirs.theta[k] / ours.theta[k], 1.0, 1e-7);
  EXPECT_NEAR(theirs.sum_of_squares / ours.sum_of_squares, 1.0, 1e-9);
}

}  // namespace
}  // namespace shaker::estimator
