// The error of the measured excitation in the posterior.
#include <cmath>
#include <complex>
#include <random>

#include <Eigen/Dense>
#include <gmock/gmock.h>

#include "estimator/inference/posterior.hpp"
#include "tests/estimator/fixtures.hpp"
#include "tests/estimator/inference/shooting.hpp"

namespace shaker::estimator {
namespace {

using Complex = std::complex<double>;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTableFrequency = 2.0;
constexpr int kTablePoints = 40;
constexpr int kParts = 6;  // cosine and sine of three harmonics

// The record of an accelerometer: amplitude * cos plus its errors `parts`.
std::vector<double> shown(double amplitude, const std::vector<double>& parts) {
  const auto table = testing::excitation_table(amplitude, parts, kTablePoints / 2);
  return {table.begin(), table.end() - 1};
}

std::vector<double> parts_of(double error, std::mt19937_64& random) {
  std::normal_distribution<double> normal(0.0, error);
  std::vector<double> out;
  for (int m = 0; m < kParts; ++m)
    out.push_back(normal(random));
  return out;
}

// y'' + c y' + k y = x in closed form: the response to harmonic h is G = 1 / (k - w^2 + i w c).
struct ClosedForm {
  double c, k, amplitude;
  Complex response(int h, double tau) const {
    const double w = 2.0 * M_PI * kTableFrequency * h;
    return std::polar(1.0, 2.0 * M_PI * h * tau) / Complex(k - w * w, w * c);
  }
  double value(double tau) const { return amplitude * response(1, tau).real(); }
  // The covariance of least squares with errors of `noise` in the response and `error` in each
  // part of the excitation.
  MatrixXd covariance(double noise, double error) const {
    MatrixXd j(kTablePoints, 2), s(kTablePoints, kParts);
    for (int i = 0; i < kTablePoints; ++i) {
      const double tau = static_cast<double>(i) / kTablePoints;
      const double w = 2.0 * M_PI * kTableFrequency;
      const Complex bend = -amplitude * response(1, tau) / Complex(k - w * w, w * c);
      j(i, 0) = (bend * Complex(0.0, w)).real();
      j(i, 1) = bend.real();
      for (int h = 1; h <= kParts / 2; ++h) {
        s(i, 2 * h - 2) = response(h, tau).real();
        s(i, 2 * h - 1) = response(h, tau).imag();
      }
    }
    const MatrixXd inverse = (j.transpose() * j).inverse();
    const MatrixXd shift = inverse * j.transpose() * s;
    return noise * noise * inverse + error * error * shift * shift.transpose();
  }
};

TEST(PosteriorOfNoisyExcitation, HasTheWidthOfClosedFormOnTheLinearOscillator) {
  constexpr double kNoise = 2e-5, kError = 5e-3;
  const ClosedForm exact{2.0, 120.0, 3.0};
  const Model model(testing::linear_oscillator());
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal(0.0, kNoise);
  RunData run;
  run.frequency_hz = kTableFrequency;
  run.excitation = shown(exact.amplitude, parts_of(kError, random));
  for (int i = 0; i < kTablePoints; ++i)
    run.displacement.push_back(exact.value(static_cast<double>(i) / kTablePoints) + normal(random));
  EstimationOptions how;
  how.noise = kNoise;
  const MatrixXd without = exact.covariance(kNoise, 0.0);
  for (const double stated : {0.0, kError}) {
    run.excitation_error = stated;
    Estimator estimator(model, {run}, how);
    const Fit& fit = estimator.fit({2.1, 118.0});
    ASSERT_EQ(fit.status, FitStatus::converged);
    const Posterior found = posterior(model, estimator, {run}, how);
    EXPECT_TRUE(found.converged);
    const MatrixXd expected = exact.covariance(kNoise, stated);
    if (stated > 0.0) {
      ASSERT_GT(expected(0, 0), 1.5 * without(0, 0)) << "the case shows nothing";
    }
    for (int k = 0; k < 2; ++k) {
      const PosteriorMarginal& p = found.parameters[static_cast<std::size_t>(k)];
      const double sd = std::sqrt(expected(k, k));
      EXPECT_NEAR(p.standard_deviation / sd, 1.0, 0.06) << k << " " << stated;
      EXPECT_NEAR(p.mean, fit.theta[static_cast<std::size_t>(k)], 0.1 * sd);
      EXPECT_NEAR((p.upper - p.lower) / (2.0 * 1.96 * sd), 1.0, 0.08);
    }
    EXPECT_NEAR(found.covariance[1] / std::sqrt(expected(0, 0) * expected(1, 1)),
                expected(0, 1) / std::sqrt(expected(0, 0) * expected(1, 1)), 0.06);
  }
}

// Compares the scatter of the estimates from 400 simulated measurements with one posterior.
TEST(PosteriorOfNoisyExcitation, IsAsWideAsEstimatesScatterOnTheOleo) {
  constexpr double kNoise = 2e-5, kError = 5e-3, kAmplitude = 3.048;
  constexpr int kRepetitions = 400;
  const testing::OleoInTime oleo{testing::kOleoSi};
  auto state = oleo.rest();
  const auto table = testing::excitation_table(kAmplitude, {}, 1600);
  for (int settle = 0; settle < 20; ++settle)
    testing::one_period(oleo, table, kTableFrequency, state, kTablePoints);
  const auto exact = testing::periodic_response(oleo, table, kTableFrequency, state, kTablePoints);
  ASSERT_TRUE(exact);
  const Model model(testing::oleo());
  EstimationOptions how;
  how.noise = kNoise;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0.0, kNoise);
  VectorXd square = VectorXd::Zero(4);
  RunData run;
  run.frequency_hz = kTableFrequency;
  for (int repetition = 0; repetition < kRepetitions; ++repetition) {
    run.excitation = shown(kAmplitude, parts_of(kError, random));
    run.displacement = *exact;
    for (double& u : run.displacement)
      u += normal(random);
    Estimator estimator(model, {run}, how);
    const Fit& fit = estimator.fit(testing::kOleoSi);
    ASSERT_EQ(fit.status, FitStatus::converged);
    for (int k = 0; k < 4; ++k) {
      const auto at = static_cast<std::size_t>(k);
      square[k] += std::pow(fit.theta[at] - testing::kOleoSi[at], 2) / kRepetitions;
    }
  }
  PosteriorOptions few;
  few.samples = 2000;
  few.rounds = 2;
  for (const double stated : {kError, 0.0}) {
    run.excitation_error = stated;
    Estimator estimator(model, {run}, how);
    estimator.fit(testing::kOleoSi);
    const Posterior found = posterior(model, estimator, {run}, how, few);
    EXPECT_TRUE(found.converged);
    for (int k = 0; k < 4; ++k) {
      const double ratio =
          found.parameters[static_cast<std::size_t>(k)].standard_deviation / std::sqrt(square[k]);
      if (stated > 0.0)
        EXPECT_NEAR(ratio, 1.0, 0.15) << k;
      else
        EXPECT_LT(ratio, 0.8) << k << ": the case shows nothing";
    }
  }
}

TEST(PosteriorOfNoisyExcitation, StaysInsideTheBounds) {
  auto spec = testing::linear_oscillator();
  const ClosedForm exact{2.0, 120.0, 3.0};
  RunData run;
  run.frequency_hz = kTableFrequency;
  run.excitation = shown(exact.amplitude, std::vector<double>(kParts, 0.0));
  run.excitation_error = 5e-3;
  for (int i = 0; i < kTablePoints; ++i)
    run.displacement.push_back(exact.value(static_cast<double>(i) / kTablePoints));
  EstimationOptions how;
  how.noise = 2e-5;
  const double sd = std::sqrt(exact.covariance(how.noise, run.excitation_error)(0, 0));
  spec.effects[0].parameters["c"].upper = 2.0 + 0.5 * sd;
  spec.effects[0].parameters["c"].start = 1.9;
  const Model model(spec);
  Estimator estimator(model, {run}, how);
  ASSERT_EQ(estimator.fit({1.9, 118.0}).status, FitStatus::converged);
  PosteriorOptions few;
  few.samples = 1000;
  few.rounds = 2;
  few.confidence = 0.999;
  const Posterior found = posterior(model, estimator, {run}, how, few);
  EXPECT_LE(found.parameters[0].upper, 2.0 + 0.5 * sd);
  EXPECT_LT(found.parameters[0].mean, 2.0);
}

}  // namespace
}  // namespace shaker::estimator
