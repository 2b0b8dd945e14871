#include "estimator/diagnosis/fit/internal/periodic_response.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/diagnosis/fit/internal/smoothing_limit.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::VectorXd;
using estimator::testing::effect;

constexpr int kPoints = 128;

RunDatum driven_at(double frequency, double amplitude) {
  RunDatum datum;
  datum.frequency_hz = frequency;
  datum.driver = VectorXd::Zero(5);
  datum.driver[1] = amplitude;
  datum.driver[4] = 0.1 * amplitude;
  datum.response = VectorXd::Zero(17);
  datum.error = VectorXd::Constant(17, 1e-6);
  return datum;
}

RunDatum channel_of(const RunDatum& displacement, Quantity quantity, int harmonics) {
  RunDatum channel = displacement;
  channel.quantity = quantity;
  channel.motion = displacement.response;
  channel.response = VectorXd::Zero(2 * harmonics + 1);
  channel.error = VectorXd::Constant(2 * harmonics + 1, 1e-3);
  return channel;
}

std::vector<RunDatum> two_runs_with_channels() {
  std::vector<RunDatum> data = {driven_at(1.5, 2.0), driven_at(2.0, 3.0)};
  data[1].response[0] = 0.01;
  for (const Quantity quantity : {Quantity::damper_force, Quantity::acceleration}) {
    for (std::size_t r = 0; r < 2; ++r)
      data.push_back(channel_of(data[r], quantity, 10));
  }
  return data;
}

TEST(PeriodicResponse, AChannelOfAnothersIsWhatItIsAlone) {
  const Model model(estimator::testing::oleo());
  const std::vector<RunDatum> data = two_runs_with_channels();
  Prediction displacement(model, data[0], kPoints);
  Prediction load(displacement, data[2]), acceleration(displacement, data[4]);
  const auto agrees = [&](Prediction& shared, const RunDatum& datum) {
    Prediction alone(model, datum, kPoints);
    ASSERT_TRUE(shared.at(estimator::testing::kOleoSi));
    ASSERT_TRUE(alone.at(estimator::testing::kOleoSi));
    EXPECT_GT(alone.value().norm(), 0.0);
    EXPECT_TRUE(shared.value().isApprox(alone.value(), 1e-12));
    EXPECT_TRUE(shared.jacobian().isApprox(alone.jacobian(), 1e-9));
  };
  agrees(displacement, data[0]);
  agrees(load, data[2]);
  agrees(acceleration, data[4]);
}

TEST(PeriodicResponse, IsOneForAllChannelsOfARunInAFit) {
  const std::vector<RunDatum> data = two_runs_with_channels();
  FitOptions options;
  options.points = kPoints;
  options.max_iterations = 0;
  const HarmonicFit fit = fit_harmonics(estimator::testing::oleo(), data,
                                        estimator::testing::kOleoSi, nullptr, options);
  ASSERT_EQ(fit.predictions.size(), data.size());
  for (std::size_t k = 2; k < data.size(); ++k)
    EXPECT_EQ(fit.predictions[k].response(), fit.predictions[k % 2].response());
  EXPECT_NE(fit.predictions[0].response(), fit.predictions[1].response());
}

// Steady response of u'' + c u' + k u + k3 u^3 = a cos(w t), by an integration of its own: from a
// large motion, on the upper branch.
VectorXd measured_cycle(const std::array<double, 3>& damper, double frequency, double amplitude,
                        double from) {
  constexpr int kSteps = 2048, kCycles = 400;
  const double w = 2.0 * std::numbers::pi * frequency, h = 1.0 / (frequency * kSteps);
  const auto rate = [&](double t, double u, double v) {
    return -damper[0] * v - damper[1] * u - damper[2] * u * u * u + amplitude * std::cos(w * t);
  };
  double u = from, v = 0.0;
  VectorXd cycle(kSteps);
  for (int k = 0; k < kSteps * kCycles; ++k) {
    const double t = k * h;
    cycle[k % kSteps] = u;
    const double k1 = rate(t, u, v), k2 = rate(t + h / 2, u + h / 2 * v, v + h / 2 * k1);
    const double k3 = rate(t + h / 2, u + h / 2 * v + h * h / 4 * k1, v + h / 2 * k2);
    const double k4 = rate(t + h, u + h * v + h * h / 2 * k2, v + h * k3);
    u += h * v + h * h / 6 * (k1 + k2 + k3);
    v += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return analysis_matrix(8, kSteps) * cycle;
}

// Small excitations lead along a branch that ends in a fold.
TEST(PeriodicResponse, IsFoundFromTheMeasuredCycleWhereNoWayLeadsFromRest) {
  const auto spec = estimator::testing::model_of(
      {effect("viscous_damping"), effect("linear_stiffness"), effect("cubic_stiffness")});
  const Model model(spec);
  const std::array<double, 3> damper = {0.4, 100.0, 4e4};
  std::vector<double> theta = model.start();
  for (std::size_t k = 0; k < theta.size(); ++k) {
    const std::string& symbol = model.parameters()[k].symbol;
    theta[k] = damper[symbol == "c" ? 0 : symbol == "k" ? 1 : 2];
  }
  RunDatum datum = driven_at(2.6, 14.0);
  datum.driver[4] = 0.0;
  Prediction blind(model, datum, kPoints);
  EXPECT_FALSE(blind.at(theta, HowFar::from_rest));
  datum.response = measured_cycle(damper, 2.6, 14.0, 0.12);
  Prediction seeing(model, datum, kPoints);
  ASSERT_TRUE(seeing.at(theta, HowFar::from_rest));
  EXPECT_LT((seeing.value() - datum.response).norm(), 1e-3 * datum.response.norm());
}

TEST(PeriodicResponse, GoesOnAfterItsRest) {
  auto spec = estimator::testing::oleo();
  spec.effects.push_back(effect("rebound_damping"));
  const Model model(spec);
  std::vector<double> theta = estimator::testing::kOleoSi;
  theta.push_back(0.5);
  const RunDatum datum = driven_at(2.0, 3.0);
  Prediction rested(model, datum, kPoints), awake(model, datum, kPoints);
  ASSERT_TRUE(rested.at(theta) && awake.at(theta));
  rested.rest();
  const auto before = awake.response()->state(), kept = rested.response()->state();
  EXPECT_TRUE(std::equal(before.begin(), before.end(), kept.begin(), kept.end()));
  EXPECT_TRUE(rested.over_excitation(3).isApprox(awake.over_excitation(3), 1e-9));
  rested.rest();
  rested.go_back();  // so that it is solved again
  ASSERT_TRUE(rested.at(theta, HowFar::near));
  EXPECT_TRUE(rested.value().isApprox(awake.value(), 1e-9));
  theta[0] *= 1.05;
  ASSERT_TRUE(rested.at(theta, HowFar::near) && awake.at(theta, HowFar::near));
  EXPECT_TRUE(rested.value().isApprox(awake.value(), 1e-9));
}

TEST(PeriodicResponse, BeginsAtTheLastSuccessAfterAFailure) {
  const Model model(estimator::testing::oleo());
  PeriodicResponse response(model, driven_at(2.0, 3.0), kPoints);
  ASSERT_TRUE(response.at(estimator::testing::kOleoSi, HowFar::from_rest));
  const auto state = response.system().state();
  const std::vector<double> known(state.begin(), state.end());
  std::vector<double> wild = estimator::testing::kOleoSi;
  wild[2] *= 1e4;  // the gas is compressed beyond its limit
  EXPECT_FALSE(response.at(wild, HowFar::near));
  EXPECT_TRUE(std::equal(known.begin(), known.end(), state.begin(), state.end()));
  EXPECT_TRUE(response.at(estimator::testing::kOleoSi, HowFar::near));
}

TEST(PeriodicResponse, BeginsWhereItBeganAfterAFailureWithoutASuccess) {
  const Model model(estimator::testing::oleo());
  const RunDatum datum = driven_at(2.0, 3.0);
  PeriodicResponse known(model, datum, kPoints), other(model, datum, kPoints);
  ASSERT_TRUE(known.at(estimator::testing::kOleoSi, HowFar::from_rest));
  other.start_from(known);
  const auto state = other.system().state();
  const std::vector<double> begun(state.begin(), state.end());
  std::vector<double> wild = estimator::testing::kOleoSi;
  wild[0] *= 1e3;
  wild[1] *= 1e4;
  EXPECT_FALSE(other.at(wild, HowFar::near));
  EXPECT_TRUE(std::equal(begun.begin(), begun.end(), state.begin(), state.end()));
}

TEST(SmoothingLimits, OfTwoChannelsAreThoseOfEachAlone) {
  auto spec = estimator::testing::oleo();
  spec.effects.push_back(effect("coulomb_friction"));
  std::vector<double> theta = estimator::testing::kOleoSi;
  theta.push_back(0.05);
  RunDatum displacement = driven_at(1.5, 3.0);
  const Model model(rounded_for(spec, displacement, kPoints));
  Prediction round(model, displacement, kPoints);
  ASSERT_TRUE(round.at(theta));
  displacement.response = round.value();
  const RunDatum load = channel_of(displacement, Quantity::damper_force, 8);
  AnalysisMatrices matrices;
  const auto both = smoothing_limits(spec, {&displacement, &load}, theta, round, kPoints, matrices);
  const auto one = smoothing_limits(spec, {&displacement}, theta, round, kPoints, matrices);
  const auto other = smoothing_limits(spec, {&load}, theta, round, kPoints, matrices);
  ASSERT_TRUE(both && one && other);
  ASSERT_EQ(both->size(), 2U);
  EXPECT_TRUE((*both)[0].value.isApprox(one->front().value, 1e-9));
  EXPECT_TRUE((*both)[1].value.isApprox(other->front().value, 1e-9));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
