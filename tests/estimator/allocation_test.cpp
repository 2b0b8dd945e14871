// The hot loop does not allocate once it has run.
#include <gtest/gtest.h>

#include "estimator/estimation.hpp"
#include "tests/estimator/counting_allocator.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

TEST(Allocation, StopsAfterTheFirstEstimate) {
  const Model model(testing::oleo(32.2));
  RunData run;
  run.frequency_hz = 2.0;
  run.amplitude = 10.0;
  for (const auto& row : testing::read_csv("oleo_j1.csv"))
    run.displacement.push_back(row[1]);
  for (const Method method : {Method::lifted, Method::levenberg_marquardt}) {
    EstimationOptions options;
    options.method = method;
    Estimator estimator(model, {run}, options);
    const std::vector<double> start = {5.334, 5.25, 1.701, 1.05};
    estimator.fit(start);
    const long before = testing::allocation_count();
    estimator.update_run(0, run);
    const Fit& fit = estimator.fit(start);
    // The static equilibrium of the nested method is no hot loop.
    if (method == Method::lifted) {
      EXPECT_EQ(testing::allocation_count(), before);
    }
    EXPECT_EQ(fit.status, FitStatus::converged);
  }
}

}  // namespace
}  // namespace shaker::estimator
