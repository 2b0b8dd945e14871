// The inner loop does not allocate after its first run.
#include <gtest/gtest.h>

#include "estimator/fit/estimation.hpp"
#include "tests/estimator/benchmark_jobs.hpp"
#include "tests/estimator/counting_allocator.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

TEST(Allocation, StopsAfterTheFirstEstimate) {
  const Model model(testing::oleo(32.2));
  const RunData run = testing::job1();
  for (const Method method : {Method::lifted, Method::levenberg_marquardt}) {
    EstimationOptions options;
    options.method = method;
    Estimator estimator(model, {run}, options);
    estimator.fit(testing::kJobStart);
    const long before = testing::allocation_count();
    estimator.update_run(0, run);
    const Fit& fit = estimator.fit(testing::kJobStart);
    // The static equilibrium of the nested method is not in the inner loop.
    if (method == Method::lifted) {
      EXPECT_EQ(testing::allocation_count(), before);
    }
    EXPECT_EQ(fit.status, FitStatus::converged);
  }
}

}  // namespace
}  // namespace shaker::estimator
