#include "estimator/diagnosis/score/calibration.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace shaker::estimator::diagnosis {
namespace {

// A random design of 80 data, 5 parameters and 30 signatures.
Design random_design(double freedom) {
  std::mt19937_64 source(4);
  std::normal_distribution<double> normal;
  const auto random = [&] { return normal(source); };
  Design d;
  d.jacobian = Eigen::MatrixXd::NullaryExpr(80, 5, random);
  d.freedom = Eigen::VectorXd::Constant(80, freedom);
  const Projector project(d.jacobian);
  for (int k = 0; k < 30; ++k) {
    const Eigen::VectorXd whole = Eigen::VectorXd::NullaryExpr(80, random);
    const Eigen::VectorXd left = project(whole);
    d.signatures.push_back({left.normalized(), left.norm(), 0.0, k % 3 - 1});
  }
  return d;
}

// The noise is generated differently from the calibration: chi-squared as a sum of squares.
double false_alarms(double freedom, double rate) {
  const Design d = random_design(freedom);
  const Calibration calibration(d, 4000, 1);
  const Projector project(d.jacobian);
  std::mt19937_64 source(99);
  std::normal_distribution<double> normal;
  std::chi_squared_distribution<double> chi_squared(freedom);
  int alarms = 0;
  constexpr int kTrials = 4000;
  for (int trial = 0; trial < kTrials; ++trial) {
    Eigen::VectorXd noise(80);
    double scale = 1.0;
    for (Eigen::Index i = 0; i < 80; ++i) {
      if (i == 0 || i % 2 == 1) scale = std::sqrt(freedom / chi_squared(source));
      noise[i] = scale * normal(source);
    }
    const Eigen::VectorXd residual = project(noise);
    double best = 0.0;
    for (const Signature& s : d.signatures)
      best = std::max(best, gain_of(s, residual));
    alarms += calibration.combined(residual.squaredNorm(), best) <= rate ? 1 : 0;
  }
  return alarms / static_cast<double>(kTrials);
}

TEST(Calibration, HoldsTheRateThatWasAskedFor) {
  EXPECT_NEAR(false_alarms(40.0, 0.05), 0.05, 0.012);
  EXPECT_NEAR(false_alarms(40.0, 0.01), 0.01, 0.006);
}

TEST(Calibration, HoldsItWithFewCyclesToo) {
  EXPECT_NEAR(false_alarms(6.0, 0.05), 0.05, 0.015);
}

TEST(Calibration, ReachesBeyondItsDraws) {
  const Calibration calibration(random_design(100.0), 2000, 1);
  EXPECT_LT(calibration.of_length(400.0), 1e-6);
  EXPECT_GT(calibration.of_length(70.0), 0.3);
  EXPECT_LT(calibration.of_best_gain(60.0), 1e-6);
}

TEST(Projector, LeavesNothingOfWhatTheParametersCanDo) {
  const Design d = random_design(10.0);
  const Projector project(d.jacobian);
  EXPECT_LT(project(d.jacobian).norm(), 1e-10 * d.jacobian.norm());
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
