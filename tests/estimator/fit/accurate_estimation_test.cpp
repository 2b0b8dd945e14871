#include "estimator/fit/internal/accurate_estimation.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/estimator/benchmark_jobs.hpp"
#include "tests/estimator/counting_allocator.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using testing::job1;
using testing::job2;
using testing::kJobStart;

double error(const std::vector<double>& theta, const std::string& reference) {
  const auto exact = testing::read_csv(reference, false).at(0);
  double worst = 0.0;
  for (std::size_t k = 0; k < theta.size(); ++k)
    worst = std::max(worst, std::fabs(theta[k] / exact[k] - 1.0));
  return worst;
}

TEST(AccurateEstimator, FindsTheExactOptimumToTheAccuracyThatIsAskedFor) {
  const Model model(testing::oleo(32.2));
  for (const double accuracy : {1e-6, 1e-8, 1e-9, 1e-10}) {
    AccurateOptions options;
    options.accuracy = accuracy;
    AccurateEstimator estimator(model, {job1()}, options);
    const Fit& fit = estimator.fit(kJobStart);
    ASSERT_EQ(fit.status, FitStatus::converged);
    EXPECT_TRUE(estimator.reached());
    const double truly = error(fit.theta, "oleo_j1_reference.csv");
    EXPECT_LT(truly, accuracy);
    EXPECT_LT(truly, 1.2 * estimator.error() + 0.1 * accuracy);
    EXPECT_LE(estimator.points(), 480);
  }
}

TEST(AccurateEstimator, TakesRunsTogether) {
  const Model model(testing::oleo(32.2));
  AccurateOptions options;
  options.accuracy = 1e-8;
  AccurateEstimator estimator(model, job2(), options);
  const Fit& fit = estimator.fit(kJobStart);
  EXPECT_TRUE(estimator.reached());
  EXPECT_LT(error(fit.theta, "oleo_j2_reference.csv"), 1e-8);
}

TEST(AccurateEstimator, SaysWhenTheGridsAllowedAreNotEnough) {
  const Model model(testing::oleo(32.2));
  AccurateOptions options;
  options.accuracy = 1e-9;
  options.most_points = 100;
  AccurateEstimator estimator(model, {job1()}, options);
  EXPECT_EQ(estimator.fit(kJobStart).status, FitStatus::converged);
  EXPECT_FALSE(estimator.reached());
  EXPECT_EQ(estimator.points(), 80);
}

TEST(AccurateEstimator, DoesNotAllocateOnceItHasRun) {
  const Model model(testing::oleo(32.2));
  AccurateEstimator estimator(model, {job1()});
  estimator.fit(kJobStart);
  const long before = testing::allocation_count();
  estimator.fit(kJobStart);
  EXPECT_EQ(testing::allocation_count(), before);
}

}  // namespace
}  // namespace shaker::estimator
