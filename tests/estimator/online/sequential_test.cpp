// Compares information filter, forgetting and extended Kalman filter with the batch estimate.
#include <cmath>

#include <gtest/gtest.h>

#include "estimator/fit/estimation.hpp"
#include "estimator/online/internal/extended_kalman.hpp"
#include "estimator/online/internal/information_filter.hpp"
#include "estimator/online/online_estimator.hpp"
#include "tests/estimator/online/cycles.hpp"

namespace shaker::estimator::online {
namespace {

using estimator::testing::kOleoSi;

const std::vector<double> kStart = {18.0, 1.4, 5.2, 1.08};

// The batch fit: every cycle is a separate run, weighted by its age, on the same grid.
Fit batch(const Model& model, const std::vector<MeasuredCycle>& cycles, double forgetting,
          const std::vector<double>& start) {
  std::vector<RunData> runs;
  for (std::size_t i = 0; i < cycles.size(); ++i) {
    RunData run;
    run.frequency_hz = cycles[i].frequency_hz;
    run.amplitude = cycles[i].amplitude;
    run.displacement = cycles[i].displacement;
    run.weight = std::pow(forgetting, static_cast<double>(cycles.size() - 1 - i));
    runs.push_back(run);
  }
  EstimationOptions options;
  options.grid = {Scheme::order6, 128, true};
  Estimator estimator(model, runs, options);
  return estimator.fit(start);
}

std::vector<MeasuredCycle> two_runs(testing::Damper& damper, const std::vector<double>& theta,
                                    int each) {
  std::vector<MeasuredCycle> cycles;
  for (int run = 0; run < 2; ++run) {
    for (int i = 0; i < each; ++i)
      cycles.push_back(damper.cycle(run, i, theta));
  }
  return cycles;
}

TEST(InformationFilter, EqualsTheBatchWhenNothingIsForgotten) {
  testing::Damper damper(estimator::testing::oleo(), 2e-4, 3);
  const Model model(testing::oleo_started(kStart));
  const auto cycles = two_runs(damper, kOleoSi, 6);
  InformationFilter filter(model, kStart, {.relinearise = 0.0});
  for (const auto& cycle : cycles)
    ASSERT_TRUE(filter.add(cycle));
  const Fit fit = batch(model, cycles, 1.0, kStart);
  const Eigen::MatrixXd covariance = filter.covariance();
  for (std::size_t k = 0; k < 4; ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    EXPECT_NEAR(filter.theta()[k] / fit.theta[k], 1.0, 1e-7);
    EXPECT_NEAR(std::sqrt(covariance(at, at)) / fit.standard_error[k], 1.0, 1e-4);
  }
  EXPECT_NEAR(filter.noise() / fit.noise, 1.0, 1e-6);
  EXPECT_DOUBLE_EQ(filter.weight(), 12.0);
}

TEST(InformationFilter, StaysWithinAHundredthOfAnIntervalWithOneSolutionACycle) {
  testing::Damper damper(estimator::testing::oleo(), 2e-4, 4);
  const Model model(testing::oleo_started(kStart));
  InformationFilter filter(model, kStart, {});
  std::vector<MeasuredCycle> cycles;
  for (long i = 0; i < 40; ++i) {
    cycles.push_back(damper.cycle(0, i, kOleoSi));
    ASSERT_TRUE(filter.add(cycles.back()));
  }
  const Fit fit = batch(model, cycles, 1.0, kStart);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(filter.theta()[k], fit.theta[k], 0.02 * fit.standard_error[k]);
  EXPECT_LT(filter.linearisations(), 3 * 40);
}

TEST(InformationFilter, EqualsTheWeightedBatchWhenItForgets) {
  const double forgetting = 0.8;
  testing::Damper damper(estimator::testing::oleo(), 2e-4, 5);
  const Model model(testing::oleo_started(kStart));
  InformationFilter filter(model, kStart, {.forgetting = forgetting, .relinearise = 0.0});
  std::vector<MeasuredCycle> cycles;
  for (long i = 0; i < 10; ++i) {
    std::vector<double> theta = kOleoSi;
    theta[0] *= 1.0 - 0.01 * static_cast<double>(i);
    cycles.push_back(damper.cycle(0, i, theta));
    ASSERT_TRUE(filter.add(cycles.back()));
  }
  const Fit fit = batch(model, cycles, forgetting, kStart);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(filter.theta()[k] / fit.theta[k], 1.0, 1e-7);
}

TEST(InformationFilter, WorksOnTheLinearOscillatorAndOnTheOleoOnItsTyre) {
  auto oscillator = estimator::testing::linear_oscillator();
  oscillator.effects[0].parameters["c"].start = 2.2;
  oscillator.effects[1].parameters["k"].start = 110.0;
  auto tyre = estimator::testing::oleo_on_tyre(0.1);
  for (std::size_t k = 0; k < 4; ++k) {
    auto& effect = tyre.effects[k == 0 ? 0 : 1];
    effect.parameters["theta" + std::to_string(k + 1)].start = kOleoSi[k] * 1.03;
  }
  tyre.effects[3].parameters["k"].start = 900.0;
  tyre.effects[3].parameters["k"].fixed = true;
  tyre.effects[4].parameters["c"].start = 5.0;
  tyre.effects[4].parameters["c"].fixed = true;
  for (const auto& spec : {oscillator, tyre}) {
    const Model model(spec);
    std::vector<double> truth = model.start();
    for (std::size_t k = 0; k < truth.size(); ++k) {
      if (!model.parameters()[k].fixed) truth[k] /= 1.03;
    }
    testing::Damper damper(spec, 1e-4, 6);
    const auto cycles = two_runs(damper, truth, 4);
    InformationFilter filter(model, model.start(), {.relinearise = 0.0});
    for (const auto& cycle : cycles)
      ASSERT_TRUE(filter.add(cycle));
    const Fit fit = batch(model, cycles, 1.0, model.start());
    ASSERT_EQ(fit.status, FitStatus::converged);
    for (std::size_t k = 0; k < truth.size(); ++k)
      EXPECT_NEAR(filter.theta()[k] / fit.theta[k], 1.0, 1e-6) << model.parameters()[k].name;
  }
}

TEST(InformationFilter, RejectsForgettingOutsideItsRange) {
  const Model model(estimator::testing::oleo());
  EXPECT_THROW(InformationFilter(model, kStart, {.forgetting = 0.0}), std::invalid_argument);
  EXPECT_THROW(InformationFilter(model, kStart, {.forgetting = 1.1}), std::invalid_argument);
}

TEST(OnlineEstimator, ForgetsLikeTheWeightedBatch) {
  const double forgetting = 0.85;
  testing::Damper damper(estimator::testing::oleo(), 2e-4, 7);
  const auto spec = testing::oleo_started(kStart);
  const Model model(spec);
  OnlineEstimator online(spec, {.forgetting = forgetting});
  const auto cycles = two_runs(damper, kOleoSi, 5);
  Estimate last;
  for (const auto& cycle : cycles) {
    const auto estimate = online.add(cycle);
    ASSERT_TRUE(estimate.ok());
    last = *estimate;
  }
  const Fit fit = batch(model, cycles, forgetting, kStart);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(last.parameters[k].value / fit.theta[k], 1.0, 1e-7);
}

// With a vague prior the first update equals the Gauss-Newton step of the batch fit.
TEST(ExtendedKalman, BeginsWithTheGaussNewtonStep) {
  testing::Damper damper(estimator::testing::oleo(), 2e-5, 8);
  const Model model(testing::oleo_started(kStart));
  const auto cycle = damper.cycle(0, 0, kOleoSi);
  const std::vector<double> near = {17.0, 1.5, 5.3, 1.02};
  ExtendedKalman filter(model, near, {.first_deviation = {1e5, 1e5, 1e5, 1e5}, .noise = 2e-5});
  ASSERT_TRUE(filter.add(cycle));
  RunData run;
  run.frequency_hz = cycle.frequency_hz;
  run.amplitude = cycle.amplitude;
  run.displacement = cycle.displacement;
  EstimationOptions options;
  options.grid = {Scheme::order6, 128, true};
  options.method = Method::gauss_newton;
  options.keep_iterates = true;
  Estimator estimator(model, {run}, options);
  const Fit& fit = estimator.fit(near);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(filter.theta()[k] / fit.iterates.front()[k], 1.0, 1e-5);
}

TEST(ExtendedKalman, ComesNearTheBatchButNotOntoIt) {
  testing::Damper damper(estimator::testing::oleo(), 2e-4, 9);
  const Model model(testing::oleo_started(kStart));
  ExtendedKalman filter(model, kStart, {.first_deviation = {5.0, 0.5, 1.0, 0.3}, .noise = 2e-4});
  std::vector<MeasuredCycle> cycles;
  for (long i = 0; i < 30; ++i) {
    cycles.push_back(damper.cycle(0, i, kOleoSi));
    ASSERT_TRUE(filter.add(cycles.back()));
  }
  const Fit fit = batch(model, cycles, 1.0, kStart);
  double worst = 0.0;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    worst = std::max(worst, std::fabs(filter.theta()[k] - fit.theta[k]) / fit.standard_error[k]);
    // The stated error is too small: cycles that are linearised at different theta seem to
    // contain more information than they do.
    const double ratio = std::sqrt(filter.covariance()(at, at)) / fit.standard_error[k];
    EXPECT_LT(ratio, 1.05);
    EXPECT_GT(ratio, 0.5);
  }
  EXPECT_LT(worst, 3.0);
  EXPECT_GT(worst, 1e-4);
}

TEST(ExtendedKalman, FollowsAParameterThatDrifts) {
  testing::Damper damper(estimator::testing::oleo(), 2e-5, 10);
  const Model model(testing::oleo_started(kOleoSi));
  ExtendedKalman filter(model, kOleoSi,
                        {.first_deviation = {0.1, 0.01, 0.01, 0.01},
                         .drift = {0.1, 1e-4, 1e-4, 1e-4},
                         .noise = 2e-5});
  std::vector<double> theta = kOleoSi;
  for (long i = 0; i < 30; ++i) {
    theta[0] = kOleoSi[0] * (1.0 - 0.005 * static_cast<double>(i));
    ASSERT_TRUE(filter.add(damper.cycle(0, i, theta)));
  }
  EXPECT_NEAR(filter.theta()[0] / theta[0], 1.0, 0.02);
}

TEST(ExtendedKalman, RejectsListsOfTheWrongLength) {
  const Model model(estimator::testing::oleo());
  EXPECT_THROW(ExtendedKalman(model, kStart, {.first_deviation = {1.0}, .noise = 1e-5}),
               std::invalid_argument);
  EXPECT_THROW(ExtendedKalman(model, kStart, {.first_deviation = {1, 1, 1, 1}, .noise = 0.0}),
               std::invalid_argument);
}

}  // namespace
}  // namespace shaker::estimator::online
