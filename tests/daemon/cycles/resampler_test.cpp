#include "daemon/cycles/resampler.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace shaker::daemon {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

std::vector<double> even(std::size_t per_period) {
  std::vector<double> tau;
  for (double x = -0.25; x < 1.25; x += 1.0 / static_cast<double>(per_period))
    tau.push_back(x);
  return tau;
}

TEST(Resample, BiasOfAHarmonicIsAsDeclared) {
  const auto tau = even(1000);
  for (const int m : {1, 4, 8}) {
    std::vector<double> value(tau.size()), out(64);
    for (std::size_t i = 0; i < tau.size(); ++i)
      value[i] = std::cos(kTwoPi * m * tau[i]);
    ASSERT_TRUE(resample(tau, value, out).ok);
    double worst = 0.0;
    for (std::size_t i = 0; i < out.size(); ++i) {
      worst =
          std::max(worst, std::abs(out[i] - std::cos(kTwoPi * m * static_cast<double>(i) / 64)));
    }
    const double declared =
        5.57 * std::pow(m, 4) / std::pow(64.0, 4);  // 0.1 m gives 0.56 a m^4/n^4
    EXPECT_LT(worst, 1.1 * declared) << m;
    EXPECT_GT(worst, 0.5 * declared) << m;
  }
}

TEST(Resample, NoiseOfThePointsIsNearlyWhiteSoThatStandardErrorsAreHonest) {
  const auto tau = even(1000);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  std::vector<double> value(tau.size()), out(64);
  double variance = 0.0, stated = 0.0, low = 0.0;
  constexpr int kTrials = 600;
  for (int trial = 0; trial < kTrials; ++trial) {
    for (auto& v : value)
      v = normal(random);
    const Resampled r = resample(tau, value, out);
    ASSERT_TRUE(r.ok);
    stated += r.point_noise * r.point_noise / kTrials;
    for (const double v : out)
      variance += v * v / 64 / kTrials;
    for (int m = 1; m <= 4; ++m) {
      std::complex<double> c = 0.0;
      for (std::size_t i = 0; i < 64; ++i) {
        c += out[i] * std::polar(1.0, -kTwoPi * m * static_cast<double>(i) / 64);
      }
      low += std::norm(c) / 64 / 4 / kTrials;  // equals the variance when white
    }
  }
  EXPECT_NEAR(variance / (64.0 / 1000.0), 1.125, 0.05);
  EXPECT_NEAR(stated / variance, 1.0, 0.03);
  EXPECT_NEAR(low / variance, 1.0, 0.08);
}

TEST(Resample, FrequenciesThatWouldFoldOntoTheParametersAreDamped) {
  const auto tau = even(2000);
  std::vector<double> value(tau.size()), out(64);
  for (std::size_t i = 0; i < tau.size(); ++i)
    value[i] = std::cos(kTwoPi * 65 * tau[i]);
  ASSERT_TRUE(resample(tau, value, out).ok);
  double power = 0.0;
  for (const double v : out)
    power += v * v / 64;
  EXPECT_LT(power / 0.5, 0.05);
}

TEST(SmoothStamps, MissingSamplesDoNotBreakTheClockAndNoiseIsNotOne) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> wander(-0.1, 0.1), any(0.0, 1.0);
  std::vector<double> t, truth;
  for (int k = 0; k < 1000; ++k) {
    if (any(random) < 0.05) continue;
    truth.push_back(1e-3 * k);
    t.push_back(1e-3 * (k + wander(random)));
  }
  std::vector<double> smooth(t.size()), scratch(t.size());
  const StampFit fit = smooth_stamps(t, smooth, scratch);
  ASSERT_TRUE(fit.ok);
  EXPECT_NEAR(fit.interval, 1e-3, 1e-8);
  EXPECT_NEAR(fit.jitter, 0.1 / std::sqrt(3.0), 0.005);
  for (std::size_t i = 0; i < t.size(); ++i)
    EXPECT_NEAR(smooth[i], truth[i], 6e-6);

  for (auto& x : t)
    x = any(random);
  std::ranges::sort(t);
  EXPECT_FALSE(smooth_stamps(t, smooth, scratch).ok);
}

TEST(SmoothStamps, FindsTwoSamplesInOnePlaceWhereverTheyAre) {
  for (const std::size_t first : {0u, 1u, 20u, 38u}) {
    std::vector<double> t;
    for (std::size_t k = 0; k < 40; ++k)
      t.push_back(1e-3 * static_cast<double>(k > first ? k - 1 : k));
    std::vector<double> smooth(t.size()), scratch(t.size());
    EXPECT_FALSE(smooth_stamps(t, smooth, scratch).ok) << first;
  }
}

// Few samples, more of them on one side: the eight nearest are taken.
TEST(Resample, OfASlowSensorTakesTheNearestSamples) {
  for (const double side : {1.0, -1.0}) {
    std::vector<double> tau;
    for (int k = 23; k >= 0; --k)
      tau.push_back(0.5 - 0.03 * side * k);
    for (int k = 1; k <= 8; ++k)
      tau.push_back(0.5 + 0.1 * side * k);
    std::vector<double> value(tau.size(), 0.0), out(8);
    value[value.size() - 6] = 1.0;  // the third on the sparse side, 0.3 from the middle
    if (side < 0.0) {
      std::ranges::reverse(tau);
      std::ranges::reverse(value);
    }
    const Resampled r = resample(tau, value, out);
    ASSERT_TRUE(r.ok);
    EXPECT_TRUE(r.sparse);
    EXPECT_NEAR(out[4], 0.0, 1e-9) << "in the middle";
    EXPECT_GT(out[side > 0.0 ? 6 : 2], 0.1) << "0.05 from that sample";
  }
}

// Within an eighth of the middle lie six samples. The two that are missing lie on the right: those
// on the left are twice as far away.
TEST(Resample, OfASlowSensorReachesAcrossNoGapToAFartherSample) {
  std::vector<double> tau;
  for (int k = 0; k < 8; ++k)
    tau.push_back(-0.25 + 0.05 * k);  // up to 0.10
  const std::size_t lonely = tau.size() - 1;
  for (const double t : {0.40, 0.44, 0.48, 0.52, 0.56, 0.60, 0.65, 0.70, 0.75, 0.80, 0.85, 0.90,
                         0.95, 1.00, 1.05, 1.10, 1.15, 1.20})
    tau.push_back(t);
  std::vector<double> value(tau.size(), 0.0), out(8);
  value[lonely] = 1.0;
  const Resampled r = resample(tau, value, out);
  ASSERT_TRUE(r.ok);
  EXPECT_TRUE(r.sparse);
  EXPECT_NEAR(out[4], 0.0, 1e-9);
}

}  // namespace
}  // namespace shaker::daemon
