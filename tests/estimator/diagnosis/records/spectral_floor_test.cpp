// Synthetic spectra: noise of known power with or without a response at low frequencies.
#include "estimator/diagnosis/records/internal/spectral_floor.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace shaker::estimator::diagnosis {
namespace {

constexpr Eigen::Index kCosines = 4000;

Eigen::VectorXd noise(double level, double slope) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  Eigen::VectorXd series(kCosines);
  for (Eigen::Index k = 0; k < kCosines; ++k)
    series[k] = std::sqrt(level * std::pow((k + 1.0) / kCosines, -slope)) * normal(random);
  return series;
}

TEST(SpectralFloor, IsTheLevelOfWhiteNoiseBesideAResponse) {
  Eigen::VectorXd series = noise(4.0, 0.0);
  for (Eigen::Index k = 0; k < 600; ++k)
    series[k] += 200.0 * std::cos(0.7 * static_cast<double>(k));
  const SpectralFloor floor = trend_floor(series, 1.0);
  // 800 cosines in the last fifth; the median determines a variance to sqrt(2.7 * 2 / 800) = 8
  // %.
  EXPECT_NEAR(floor.power[0] / 4.0, 1.0, 0.25);
  EXPECT_NEAR(floor.power[kCosines - 1] / 4.0, 1.0, 0.25);
  EXPECT_GE(floor.band, 600);
  EXPECT_LE(floor.band, 600 + 3 * kCosines / 64);
  EXPECT_TRUE(floor.reached);
  EXPECT_GT(upper_power(floor)[0], floor.power[0]);
}

TEST(SpectralFloor, CarriesANoiseThatFallsWithFrequencyDownWithItsSlope) {
  const SpectralFloor floor = trend_floor(noise(1.0, 0.8), 1.0);
  for (const double at : {0.5, 0.7, 0.9}) {  // at lower frequencies the slope is hardly known
    const auto k = static_cast<Eigen::Index>(at * kCosines);
    EXPECT_NEAR(floor.power[k] * std::pow(at, 0.8), 1.0, 0.6) << at;
  }
}

TEST(SpectralFloor, SaysThatAResponseWhichFillsTheSpectrumLeavesNoFloor) {
  Eigen::VectorXd series = noise(1.0, 0.0);
  series.head(3600) *= 30.0;
  EXPECT_FALSE(trend_floor(series, 1.0).reached);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
