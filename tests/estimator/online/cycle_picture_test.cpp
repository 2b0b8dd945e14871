#include "estimator/online/cycle_picture.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "estimator/online/online_estimator.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

constexpr int kPicturePoints = 64;
constexpr double kHz = 2.0, kOmega = 2.0 * std::numbers::pi * kHz;

double tau_of(int i) {
  return 2.0 * std::numbers::pi * i / kPicturePoints;
}
double force_of_nobody(int i) {
  return 0.3 * std::cos(3.0 * tau_of(i)) - 0.1 * std::sin(tau_of(i));
}

// A motion of two harmonics, and the excitation under which an oscillator with damping c,
// stiffness k and force_of_nobody moves so: u'' + c u' + k u + force = x.
MeasuredCycle imposed(double c, double k) {
  MeasuredCycle cycle;
  cycle.frequency_hz = kHz;
  for (int i = 0; i < kPicturePoints; ++i) {
    const double t = tau_of(i);
    const double u = 0.05 + 0.02 * std::cos(t) + 0.004 * std::sin(2.0 * t);
    const double v = kOmega * (-0.02 * std::sin(t) + 0.008 * std::cos(2.0 * t));
    const double a = kOmega * kOmega * (-0.02 * std::cos(t) - 0.016 * std::sin(2.0 * t));
    cycle.displacement.push_back(u);
    cycle.excitation.push_back(a + c * v + k * u + force_of_nobody(i));
  }
  return cycle;
}

TEST(MissingForce, IsTheForceThatTheModelLacks) {
  const Model model(testing::linear_oscillator());
  const double c = 8.0, k = 400.0;
  const auto missing = online::missing_force(model, {c, k}, imposed(c, k));
  ASSERT_EQ(missing.size(), static_cast<std::size_t>(kPicturePoints));
  for (int i = 0; i < kPicturePoints; ++i)
    EXPECT_NEAR(missing[static_cast<std::size_t>(i)], force_of_nobody(i), 1e-10);
}

TEST(MissingForce, IsEmptyWhereOneMotionDoesNotTell) {
  const Model two(testing::oleo_on_tyre(0.1));
  EXPECT_TRUE(online::missing_force(two, two.start(), imposed(8.0, 400.0)).empty());
  const Model one(testing::linear_oscillator());
  MeasuredCycle coarse = imposed(8.0, 400.0);
  coarse.displacement.resize(16);
  coarse.excitation.resize(16);
  EXPECT_TRUE(online::missing_force(one, {8.0, 400.0}, coarse).empty());
}

TEST(CyclePicture, IsThatOfTheLastCycleAndEmptyWithoutAnEstimate) {
  OnlineEstimator online(testing::linear_oscillator());
  MeasuredCycle cycle = imposed(8.0, 400.0);
  EXPECT_TRUE(online.picture(cycle).response.empty());
  cycle.displacement[3] = std::nan("");
  EXPECT_FALSE(online.add(cycle));
  EXPECT_TRUE(online.picture(cycle).response.empty());
  cycle = imposed(8.0, 400.0);
  const auto estimate = online.add(cycle);
  ASSERT_TRUE(estimate) << estimate.error().what;
  const CyclePicture picture = online.picture(cycle);
  ASSERT_EQ(picture.response.size(), cycle.displacement.size());
  // One cycle, so the misfit of the picture is the sum of squares of the estimate.
  double sum = 0.0;
  for (std::size_t i = 0; i < cycle.displacement.size(); ++i)
    sum += std::pow(cycle.displacement[i] - picture.response[i], 2);
  EXPECT_NEAR(sum, estimate->sum_of_squares, 1e-9 * sum);
  online.reset();
  EXPECT_TRUE(online.picture(cycle).response.empty());
}

}  // namespace
}  // namespace shaker::estimator
