// Estimates cycle by cycle where a parameter differs from run to run.
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cycles.hpp"
#include "estimator/fit/estimation.hpp"
#include "estimator/model/run_models.hpp"
#include "estimator/online/online_estimator.hpp"

namespace shaker::estimator::online {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kWhiteNoise = 2e-5;
constexpr double kPreload[] = {1.8, 1.98};  // of the two runs, m/s^2

std::vector<double> theta_of(int run) {
  std::vector<double> theta = estimator::testing::kOleoSi;
  theta[1] = kPreload[run];
  return theta;
}

config::ModelSpec oleo_with(config::RunVariation variation) {
  auto spec = testing::oleo_started({14.0, 1.7, 4.5, 1.15});
  spec.effects[1].parameters["theta2"].variation = std::move(variation);
  return spec;
}

OnlineOptions of_runs(std::vector<config::RunCondition> runs) {
  OnlineOptions options;
  options.runs = std::move(runs);
  return options;
}

// `cycles` of each run in turn. Returns the last estimate.
Estimate measured(OnlineEstimator& online, testing::Damper& damper, long cycles) {
  Estimate last;
  for (int run = 0; run < 2; ++run) {
    for (long index = 0; index < cycles; ++index) {
      const auto estimate = online.add(damper.cycle(run, index, theta_of(run)));
      EXPECT_TRUE(estimate) << (estimate ? "" : estimate.error().what);
      if (estimate) last = *estimate;
    }
  }
  return last;
}

void expect_near_truth(const Estimate& estimate, int run) {
  ASSERT_EQ(estimate.parameters.size(), 4U);
  EXPECT_THAT(estimate.covariance_order, ElementsAre("theta1", "theta2", "theta3", "theta4"));
  EXPECT_TRUE(estimate.usable);
  const std::vector<double> truth = theta_of(run);
  for (std::size_t k = 0; k < 4; ++k) {
    const ParameterEstimate& p = estimate.parameters[k];
    EXPECT_LT(std::fabs(p.value - truth[k]), 5.0 * p.standard_error) << p.name << " in " << run;
    EXPECT_LT(p.standard_error, 0.02 * truth[k]) << p.name;
    EXPECT_NEAR(estimate.covariance[5 * k], p.standard_error * p.standard_error,
                1e-9 * p.standard_error * p.standard_error);
  }
}

TEST(RunView, ShowsTheValueInTheRunThatIsMeasured) {
  testing::Damper damper(estimator::testing::oleo(), kWhiteNoise, 4);
  OnlineEstimator online(oleo_with({"run", "", {}}), of_runs({{"cold", "", {}}, {"warm", "", {}}}));
  const Estimate last = measured(online, damper, 12);
  expect_near_truth(last, 1);
  EXPECT_EQ(last.parameters[1].name, "theta2");
  EXPECT_THAT(last.warnings,
              ElementsAre("theta2 is as in run warm: the model lets it differ between runs"));
  const auto again = online.add(damper.cycle(0, 12, theta_of(0)));
  ASSERT_TRUE(again) << again.error().what;
  expect_near_truth(*again, 0);
  online.reset();
  const auto fresh = online.add(damper.cycle(1, 0, theta_of(1)));
  ASSERT_TRUE(fresh) << fresh.error().what;
  EXPECT_EQ(fresh->runs, 1);
}

TEST(RunView, EndsWhereTheJointEstimateOfBothRunsEnds) {
  const auto spec = oleo_with({"run", "", {}});
  const std::vector<config::RunCondition> runs = {{"cold", "", {}}, {"warm", "", {}}};
  testing::Damper damper(estimator::testing::oleo(), kWhiteNoise, 5);
  OnlineEstimator online(spec, of_runs(runs));
  const auto models = run_models(spec, runs);
  ASSERT_TRUE(models) << models.error().what;
  std::vector<RunData> batch;
  Estimate last;
  for (int run = 0; run < 2; ++run) {
    const MeasuredCycle cycle = damper.cycle(run, 0, theta_of(run));
    const auto estimate = online.add(cycle);
    ASSERT_TRUE(estimate) << estimate.error().what;
    last = *estimate;
    RunData data;
    data.frequency_hz = cycle.frequency_hz;
    data.amplitude = cycle.amplitude;
    data.displacement = cycle.displacement;
    data.model = models->of_run[static_cast<std::size_t>(run)];
    batch.push_back(std::move(data));
  }
  EstimationOptions options;
  options.grid = {Scheme::order6, OnlineOptions{}.grid_points, true};
  Estimator estimator(models->joint(), std::move(batch), options);
  const Fit& fit = estimator.fit(models->joint().start());
  const int warm[] = {0, 2, 3, 4};  // theta1, theta2[warm], theta3, theta4
  for (std::size_t k = 0; k < 4; ++k) {
    const auto at = static_cast<std::size_t>(warm[k]);
    const double error = fit.standard_error[at];
    const ParameterEstimate& p = last.parameters[k];
    EXPECT_NEAR((p.value + p.bias - fit.theta[at]) / error, 0.0, 1e-3) << p.name;
    EXPECT_NEAR(p.standard_error / error, 1.0, 1e-3) << p.name;
  }
}

TEST(RunView, GoesWithTheConditionOfTheRun) {
  testing::Damper damper(estimator::testing::oleo(), kWhiteNoise, 6);
  const auto spec = oleo_with({"", "gas_temperature", {}});
  OnlineEstimator online(spec, of_runs({{"cold", "", {{"gas_temperature", 280.0}}},
                                        {"warm", "", {{"gas_temperature", 308.0}}}}));
  expect_near_truth(measured(online, damper, 12), 1);
  OnlineEstimator as_one(spec);  // without conditions one value is taken for both
  EXPECT_FALSE(measured(as_one, damper, 12).intervals_hold);
}

TEST(RunView, RefusesARunThatTheCampaignDoesNotHaveOrThatLacksItsCondition) {
  testing::Damper damper(estimator::testing::oleo(), kWhiteNoise, 7);
  OnlineEstimator online(oleo_with({"run", "", {}}), of_runs({{"cold", "", {}}}));
  ASSERT_TRUE(online.add(damper.cycle(0, 0, theta_of(0))));
  EXPECT_THAT(online.add(damper.cycle(1, 0, theta_of(1))).error().what,
              HasSubstr("run 2 is not one of the campaign's 1"));
  const auto estimate = online.add(damper.cycle(0, 1, theta_of(0)));  // nothing is lost
  ASSERT_TRUE(estimate);
  EXPECT_EQ(estimate->cycles, 2);
  OnlineEstimator grouped(oleo_with({"group", "", {}}), of_runs({{"cold", "", {}}}));
  EXPECT_THAT(grouped.add(damper.cycle(0, 0, theta_of(0))).error().what,
              HasSubstr("run cold has no \"group\""));
}

}  // namespace
}  // namespace shaker::estimator::online
