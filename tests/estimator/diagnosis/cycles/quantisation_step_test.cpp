#include "estimator/diagnosis/cycles/internal/quantisation_step.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace shaker::estimator::diagnosis {
namespace {

// A cosine of 8 mm about 0.15 m with noise, rounded to quantisation steps with any origin.
std::vector<double> samples(double quantisation_step, double noise, double origin = 0.0) {
  std::mt19937_64 source(3);
  std::normal_distribution<double> normal;
  std::vector<double> values;
  for (int i = 0; i < 4000; ++i) {
    const double u =
        0.15 + 8e-3 * std::cos((2.0 * std::numbers::pi) * i / 311.7) + noise * normal(source);
    values.push_back(quantisation_step > 0.0
                         ? origin + quantisation_step * std::round((u - origin) / quantisation_step)
                         : u);
  }
  return values;
}

TEST(QuantisationStep, IsReadFromTheValues) {
  EXPECT_NEAR(quantisation_step_of(samples(1e-4, 2e-5)), 1e-4, 1e-12);
  EXPECT_NEAR(quantisation_step_of(samples(1e-4, 0.0)), 1e-4, 1e-12);
  // A 12-bit converter over 30 mm with an arbitrary zero.
  EXPECT_NEAR(quantisation_step_of(samples(0.03 / 4096, 1e-6, 0.1234567)), 0.03 / 4096, 1e-12);
  EXPECT_NEAR(quantisation_step_of(samples(1e-6, 2e-5)), 1e-6, 1e-12);
}

TEST(QuantisationStep, AllowsForDigitsThatWereCutOff) {
  std::vector<double> values = samples(0.03 / 4096, 1e-6, 0.1234567);
  for (double& v : values)
    v = std::round(v * 1e8) * 1e-8;
  EXPECT_NEAR(quantisation_step_of(values), 0.03 / 4096, 1e-10);
}

TEST(QuantisationStep, IsNoneOfValuesThatStandAnywhere) {
  EXPECT_EQ(quantisation_step_of(samples(0.0, 2e-5)), 0.0);
  EXPECT_EQ(quantisation_step_of(samples(0.0, 0.0)), 0.0);
  std::vector<double> off = samples(1e-4, 2e-5);
  off[1234] += 4e-5;
  EXPECT_EQ(quantisation_step_of(off), 0.0) << "one value between the steps";
  EXPECT_EQ(quantisation_step_of({}), 0.0);
}

// Amplitudes in closed form: the k-th harmonic of the saw tooth along A cos is q / (pi k) times
// twice a Bessel function of 2 pi k A / q.
double bessel_variance(int order, double amplitude, double quantisation_step, double noise) {
  double sum = 0.0;
  for (int k = 1; k < 400; ++k) {
    const double kept =
        std::exp(-2.0 * std::pow(std::numbers::pi * k * noise / quantisation_step, 2));
    const double size =
        2.0 * quantisation_step / (std::numbers::pi * k) * kept *
        std::cyl_bessel_j(order, (2.0 * std::numbers::pi) * k * amplitude / quantisation_step);
    sum += 0.5 * size * size;  // averaged over the origin of the grid, cosine and sine
  }
  return 0.5 * sum;
}

TEST(QuantisationStep, MovesAMeanCycleByWhatBesselFunctionsSay) {
  const double amplitude = 8e-3, quantisation_step = 2e-4;
  Eigen::VectorXd curve = Eigen::VectorXd::Zero(33);
  curve[0] = 0.15;
  curve[1] = amplitude;
  for (const double noise : {0.0, 0.2 * quantisation_step, 0.4 * quantisation_step}) {
    const auto variance = rounding_variance(curve, quantisation_step, noise, {7919.3, 5});
    for (const int h : {4, 8, 12}) {
      double expected = 0.0;
      for (int near = h - 2; near <= h + 2; ++near)
        expected += bessel_variance(near, amplitude, quantisation_step, noise) / 5.0;
      EXPECT_NEAR(variance[2 * h], expected, 0.15 * expected) << h << " noise " << noise;
    }
  }
}

TEST(QuantisationStep, IsBlurredByNoise) {
  Eigen::VectorXd curve = Eigen::VectorXd::Zero(33);
  curve[1] = 8e-3;
  const double sharp = rounding_variance(curve, 1e-4, 0.0, {997.3, 14}).sum();
  EXPECT_GT(sharp, 0.0);
  EXPECT_LT(rounding_variance(curve, 1e-4, 6e-5, {997.3, 14}).sum(), 1e-4 * sharp);
  EXPECT_EQ(rounding_variance(curve, 1e-4, 1e-4, {997.3, 14}).sum(), 0.0);
  EXPECT_EQ(rounding_variance(curve, 0.0, 0.0, {997.3, 14}).sum(), 0.0);
}

// Every cycle is rounded in the same way, so the mean has the error of one cycle.
TEST(QuantisationStep, DoesNotAverageOutWhereEveryCycleIsSampledAlike) {
  Eigen::VectorXd curve = Eigen::VectorXd::Zero(33);
  curve[1] = 8e-3;
  const double alike = rounding_variance(curve, 1e-5, 0.0, {1000.0, 14}).sum();
  const double shifted = rounding_variance(curve, 1e-5, 0.0, {1000.0 + 0.618, 14}).sum();
  EXPECT_GT(alike, 5.0 * shifted);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
