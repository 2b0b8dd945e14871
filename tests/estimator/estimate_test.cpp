// From runs to their estimate. The runs are those of a damped linear oscillator in closed form.
#include "estimator/estimate.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using namespace testing;

constexpr double kDamping = 2.0, kStiffness = 400.0, kNoise = 1e-5;

RunData run_at(double frequency_hz, double stiffness, unsigned seed) {
  const double omega = 2.0 * std::numbers::pi * frequency_hz;
  const double real = stiffness - omega * omega, imaginary = kDamping * omega;
  RunData run;
  run.frequency_hz = frequency_hz;
  run.amplitude = 3.0;
  const double size = run.amplitude / std::hypot(real, imaginary);
  const double lag = std::atan2(imaginary, real);
  std::mt19937_64 source(seed);
  std::normal_distribution<double> noise(0.0, kNoise);
  for (int i = 0; i < 64; ++i)
    run.displacement.push_back(size * std::cos(2.0 * std::numbers::pi * i / 64.0 - lag) +
                               noise(source));
  return run;
}

config::ModelSpec oscillator() {
  config::ModelSpec spec = linear_oscillator();
  spec.effects[0].parameters["c"].start = 1.7;
  spec.effects[1].parameters["k"].start = 380.0;
  return spec;
}

void expect_truth(const Estimate& estimate) {
  ASSERT_EQ(estimate.parameters.size(), 2U);
  const double truth[] = {kDamping, kStiffness};
  for (std::size_t k = 0; k < 2; ++k) {
    const ParameterEstimate& p = estimate.parameters[k];
    EXPECT_LT(std::fabs(p.value - truth[k]), 4.0 * p.standard_error) << p.name;
    EXPECT_LT(p.standard_error, 1e-2 * truth[k]) << p.name;
    EXPECT_LT(p.lower, p.value);
    EXPECT_GT(p.upper, p.value);
  }
}

TEST(EstimateRuns, EveryWayFindsTheTruth) {
  const std::vector<RunData> runs = {run_at(1.5, kStiffness, 1), run_at(2.5, kStiffness, 2)};
  RunsEstimateOptions options;
  const auto plain = estimate(oscillator(), runs, options);
  ASSERT_TRUE(plain.ok()) << plain.error().what;
  expect_truth(plain->estimate);
  EXPECT_FALSE(plain->searched || plain->sampled || plain->grid);
  options.loss = Loss::huber;
  options.starts = 3;
  const auto robust = estimate(oscillator(), runs, options);
  ASSERT_TRUE(robust.ok()) << robust.error().what;
  expect_truth(robust->estimate);
  ASSERT_TRUE(robust->searched);
  EXPECT_GE(robust->searched->found.size(), 1U);
  options = {};
  options.accuracy = 1e-9;
  options.intervals = IntervalKind::profile;
  const auto refined = estimate(oscillator(), runs, options);
  ASSERT_TRUE(refined.ok()) << refined.error().what;
  expect_truth(refined->estimate);
  ASSERT_TRUE(refined->grid);
  EXPECT_TRUE(refined->grid->reached);
  options = {};
  options.posterior = true;
  const auto sampled = estimate(oscillator(), runs, options);
  ASSERT_TRUE(sampled.ok()) << sampled.error().what;
  expect_truth(sampled->estimate);
  ASSERT_TRUE(sampled->sampled);
  EXPECT_TRUE(sampled->sampled->converged);
}

TEST(EstimateRuns, AParameterMayDifferFromRunToRun) {
  config::ModelSpec spec = oscillator();
  spec.effects[1].parameters["k"].variation.per = "run";
  std::vector<RunData> runs = {run_at(1.5, kStiffness, 1), run_at(2.5, 420.0, 2)};
  runs[0].condition.run = "a";
  runs[1].condition.run = "b";
  const auto found = estimate(spec, runs);
  ASSERT_TRUE(found.ok()) << found.error().what;
  ASSERT_EQ(found->in_runs.size(), 2U);
  EXPECT_EQ(found->in_runs[1].run, "b");
  EXPECT_NEAR(found->in_runs[0].value, kStiffness, 4.0 * found->in_runs[0].standard_error);
  EXPECT_NEAR(found->in_runs[1].value, 420.0, 4.0 * found->in_runs[1].standard_error);
}

TEST(EstimateRuns, ALinearModelHasNoResponseOverTwoPeriods) {
  RunData run = run_at(1.5, kStiffness, 1);
  run.periods = 2;
  const auto found = estimate(oscillator(), {run});
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.error().kind, ErrorKind::invalid);
}

}  // namespace
}  // namespace shaker::estimator
