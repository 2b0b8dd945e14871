#include <gtest/gtest.h>

#include "estimator/paper/internal/ceres_estimation.hpp"
#include "tests/estimator/benchmark_jobs.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

TEST(CeresEstimator, EndsAtTheSameOptimum) {
  const Model model(testing::oleo(32.2));
  const RunData run = testing::job1();
  CeresEstimator ceres(model, {run});
  Estimator own(model, {run});
  const CeresFit theirs = ceres.fit(testing::kJobStart);
  const Fit& ours = own.fit(testing::kJobStart);
  ASSERT_TRUE(theirs.converged);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(theirs.theta[k] / ours.theta[k], 1.0, 1e-7);
  EXPECT_NEAR(theirs.sum_of_squares / ours.sum_of_squares, 1.0, 1e-9);
}

}  // namespace
}  // namespace shaker::estimator
