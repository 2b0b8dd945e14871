#include "estimator/inference/internal/profile.hpp"

#include <cmath>
#include <random>

#include <gmock/gmock.h>

#include "estimator/inference/monte_carlo.hpp"
#include "estimator/paper/internal/ceres_estimation.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

// Figure 13: at half the amplitude the spring has little effect.
std::vector<RunData> figure13(unsigned seed, double width = 0.0055) {
  const Model model(testing::oleo(32.178));
  auto runs = *exact_data(model, {{2.0, 5.0, 40, 1.0}}, testing::kOleoFeet);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> noise(-width, width);
  for (double& u : runs[0].displacement)
    u += noise(random);
  return runs;
}

// With the parameter fixed at the end of the interval, Ceres must find a sum of squares that is
// larger by t^2 s^2.
TEST(Profile, EndsWhereAnotherOptimiserFindsTheSumOfSquaresRisenByTSquared) {
  const auto spec = testing::oleo(32.178);
  const Model model(spec);
  const auto runs = figure13(1, 0.003);
  Estimator estimator(model, runs);
  ASSERT_EQ(estimator.fit(testing::kOleoFeet).status, FitStatus::converged);
  const Fit fit = estimator.last();
  const auto intervals = profile_intervals(estimator, model);
  ASSERT_EQ(intervals.size(), 4U);
  const char* const names[] = {"theta1", "theta2", "theta3", "theta4"};
  for (const ProfileInterval& interval : intervals) {
    const int k = interval.parameter;
    EXPECT_FALSE(interval.lower_open) << k;
    EXPECT_FALSE(interval.upper_open) << k;
    for (const double end : {interval.lower, interval.upper}) {
      auto fixed = spec;
      auto& parameter = fixed.effects[k == 0 ? 0 : 1].parameters[names[k]];
      parameter.start = end;
      parameter.fixed = true;
      const Model held(fixed);
      CeresEstimator ceres(held, runs);
      std::vector<double> start = fit.theta;
      start[static_cast<std::size_t>(k)] = end;
      const CeresFit at_end = ceres.fit(start);
      const double rise = (at_end.sum_of_squares - fit.sum_of_squares) / (fit.noise * fit.noise);
      EXPECT_NEAR(std::sqrt(rise), fit.quantile, 5e-3 * fit.quantile) << k << " at " << end;
    }
  }
  // The interval is far from symmetric, which is why it is needed.
  const auto& last = intervals[3];
  EXPECT_GT((last.upper - fit.theta[3]) / (fit.theta[3] - last.lower), 1.5);
  // The estimator is unchanged.
  EXPECT_EQ(estimator.last().theta, fit.theta);
  EXPECT_EQ(estimator.fit(fit.theta, true).status, FitStatus::converged);
}

TEST(Profile, EqualsTheLinearIntervalWhereTheNoiseIsSmall) {
  const Model model(testing::oleo(32.178));
  auto runs = *exact_data(model, {{2.0, 10.0, 40, 1.0}}, testing::kOleoFeet);
  std::mt19937_64 random(2);
  std::normal_distribution<double> noise(0.0, 1e-6);
  for (double& u : runs[0].displacement)
    u += noise(random);
  Estimator estimator(model, runs);
  const Fit fit = estimator.fit(testing::kOleoFeet);
  for (const ProfileInterval& interval : profile_intervals(estimator, model)) {
    const auto k = static_cast<std::size_t>(interval.parameter);
    const double half = fit.quantile * fit.standard_error[k];
    EXPECT_NEAR(interval.lower, fit.theta[k] - half, 5e-3 * half);
    EXPECT_NEAR(interval.upper, fit.theta[k] + half, 5e-3 * half);
  }
}

TEST(Profile, SaysWhereABoundIsTheEnd) {
  auto spec = testing::oleo(32.178);
  spec.effects[1].parameters["theta4"].start = 1.0;
  spec.effects[1].parameters["theta4"].upper = 1.1;
  const Model model(spec);
  auto runs = *exact_data(model, {{2.0, 5.0, 40, 1.0}}, testing::kOleoFeet);
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 2e-3);
  for (double& u : runs[0].displacement)
    u += noise(random);
  Estimator estimator(model, runs);
  const Fit& fit = estimator.fit(testing::kOleoFeet);
  ASSERT_EQ(fit.status, FitStatus::converged);
  const ProfileInterval interval = profile_interval(estimator, model, 3);
  EXPECT_TRUE(interval.upper_open);
  EXPECT_DOUBLE_EQ(interval.upper, 1.1);
}

TEST(Profile, ContainsWhatItsIntervalContains) {
  const Model model(testing::oleo(32.178));
  for (const unsigned seed : {4U, 5U, 6U}) {
    Estimator estimator(model, figure13(seed));
    if (estimator.fit(testing::kOleoFeet).status != FitStatus::converged) continue;
    for (const ProfileInterval& i : profile_intervals(estimator, model)) {
      const double width = i.upper - i.lower;
      EXPECT_TRUE(profile_contains(estimator, model, i.parameter, i.lower + 0.01 * width));
      EXPECT_FALSE(profile_contains(estimator, model, i.parameter, i.lower - 0.01 * width));
      EXPECT_TRUE(profile_contains(estimator, model, i.parameter, i.upper - 0.01 * width));
      EXPECT_FALSE(profile_contains(estimator, model, i.parameter, i.upper + 0.01 * width));
    }
  }
}

TEST(Profile, WorksWithPriorsTwoCoordinatesAndTheLinearOscillator) {
  auto tyre = testing::oleo_on_tyre(0.1);
  tyre.effects[3].parameters["k"].start = 900.0;
  auto prior = testing::linear_oscillator();
  prior.effects[1].parameters["k"].prior_mean = 60.0;
  prior.effects[1].parameters["k"].prior_standard_deviation = 0.01;
  auto truth = testing::kOleoSi;
  truth.push_back(900.0);
  truth.push_back(2.0);
  struct Case {
    config::ModelSpec spec;
    std::vector<double> truth;
    RunDesign run;
  };
  for (const Case& c :
       {Case{tyre, truth, {2.0, 3.048, 40, 1.0}}, Case{prior, {3.0, 60.0}, {1.0, 2.0, 40, 1.0}}}) {
    const Model model(c.spec);
    auto runs = *exact_data(model, {c.run}, c.truth);
    std::mt19937_64 random(7);
    std::normal_distribution<double> noise(0.0, 1e-6);
    for (double& u : runs[0].displacement)
      u += noise(random);
    Estimator estimator(model, runs);
    const Fit fit = estimator.fit(c.truth);
    ASSERT_EQ(fit.status, FitStatus::converged) << fit.trouble;
    const auto intervals = profile_intervals(estimator, model);
    EXPECT_EQ(intervals.size(), c.truth.size());
    for (const ProfileInterval& interval : intervals) {
      const auto k = static_cast<std::size_t>(interval.parameter);
      const double half = fit.quantile * fit.standard_error[k];
      EXPECT_NEAR(interval.upper - interval.lower, 2.0 * half, 0.03 * half) << k;
    }
  }
}

}  // namespace
}  // namespace shaker::estimator
