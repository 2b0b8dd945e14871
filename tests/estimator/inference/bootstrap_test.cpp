#include "estimator/inference/internal/bootstrap.hpp"

#include <cmath>
#include <random>

#include <gmock/gmock.h>

#include "estimator/fit/harmonic_data.hpp"
#include "estimator/inference/monte_carlo.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

std::vector<RunData> noisy(const Model& model, const std::vector<double>& truth, RunDesign design,
                           double deviation, unsigned seed) {
  auto runs = *exact_data(model, {design}, truth);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, deviation);
  for (double& u : runs[0].displacement)
    u += normal(random);
  return runs;
}

TEST(Bootstrap, AgreesWithTheLinearIntervalWhereTheNoiseIsSmall) {
  const Model model(testing::oleo(32.178));
  const auto runs = noisy(model, testing::kOleoFeet, {2.0, 10.0, 40, 1.0}, 1e-5, 1);
  Estimator estimator(model, runs);
  const Fit fit = estimator.fit(testing::kOleoFeet);
  const Bootstrap made = bootstrap(model, estimator, runs, {});
  EXPECT_EQ(made.converged, 1000);
  ASSERT_EQ(made.intervals.size(), 4U);
  for (const BootstrapInterval& i : made.intervals) {
    const auto k = static_cast<std::size_t>(i.parameter);
    const double half = fit.quantile * fit.standard_error[k];
    EXPECT_NEAR(i.standard_error / fit.standard_error[k], 1.0, 0.1);
    EXPECT_LT(std::fabs(i.bias), 0.12 * fit.standard_error[k]);
    EXPECT_NEAR((i.upper - i.lower) / (2.0 * half), 1.0, 0.12);
  }
}

// theta4 of figure 12 has a bias of 0.107 and a scatter of 1.041 bounds in 10 000 repetitions.
TEST(Bootstrap, SeesTheBiasThatTheLinearisationDoesNot) {
  const Model model(testing::oleo(32.178));
  const auto runs = *exact_data(model, {{2.0, 10.0, 40, 1.0}}, testing::kOleoFeet);
  BootstrapOptions options;
  options.estimation.noise = 0.00329;
  options.replications = 2000;
  Estimator estimator(model, runs, options.estimation);
  const Fit fit = estimator.fit(testing::kOleoFeet);
  const Bootstrap made = bootstrap(model, estimator, runs, options);
  EXPECT_NEAR(made.intervals[3].bias / fit.standard_error[3], 0.107, 0.08);
}

TEST(Bootstrap, GivesTheSameForAnyNumberOfThreadsAndWorksOnFourierCoefficients) {
  const Model model(testing::linear_oscillator());
  const auto exact = *exact_data(model, {{1.0, 2.0, 64, 1.0}}, {3.0, 60.0});
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal(0.0, 1e-5);
  HarmonicMean mean(7);
  for (int c = 0; c < 40; ++c) {
    auto cycle = exact[0].displacement;
    for (double& u : cycle)
      u += normal(random);
    mean.add(cycle);
  }
  auto runs = exact;
  mean.into(runs[0]);
  Estimator estimator(model, runs);
  const Fit fit = estimator.fit({2.5, 55.0});
  ASSERT_EQ(fit.status, FitStatus::converged) << fit.trouble;
  BootstrapOptions options;
  options.threads = 1;
  const Bootstrap one = bootstrap(model, estimator, runs, options);
  options.threads = 3;
  const Bootstrap three = bootstrap(model, estimator, runs, options);
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ(one.intervals[k].lower, three.intervals[k].lower);
    EXPECT_EQ(one.intervals[k].upper, three.intervals[k].upper);
    const double half = fit.quantile * fit.standard_error[k];
    EXPECT_NEAR((one.intervals[k].upper - one.intervals[k].lower) / (2.0 * half), 1.0, 0.2);
  }
  options.replications = 5;
  EXPECT_THROW(bootstrap(model, estimator, runs, options), std::invalid_argument);
}

}  // namespace
}  // namespace shaker::estimator
