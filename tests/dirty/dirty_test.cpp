// The dirty world against what can be said of it in closed form.
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/dirty/campaign.hpp"
#include "tests/sanitized.hpp"

namespace shaker::dirty {
namespace {

constexpr const char* kOfTheTests = "the dirty world is one of the tests, not of the product";

Run decay(double from, double duration) {
  Run run;
  run.drive = Drive::kDecay;
  run.start_stroke = from;
  run.duration = duration;
  run.step = 0.01;
  return run;
}

TEST(DirtyWorld, ALinearOscillatorDecaysAsInTheTextbook) {
  const Channels c = moved(Device({{"c", 0.8}, {"k", 100.0}}, {}, false), {}, decay(0.03, 10.0));
  const double omega = std::sqrt(100.0 - 0.16);
  ASSERT_EQ(c.time.size(), 1000U);
  for (std::size_t i = 0; i < c.time.size(); ++i) {
    const double t = c.time[i];
    const double exact =
        0.03 * std::exp(-0.4 * t) * (std::cos(omega * t) + 0.4 / omega * std::sin(omega * t));
    ASSERT_NEAR(c.response[i], exact, 1e-9) << t;
  }
}

// Each half cycle takes 2 f_c / k from the amplitude. The damper stays where its spring no longer
// overcomes the friction: from 30 mm by steps of 8 mm at -22, 14 and -6 mm, then at -2 mm.
TEST(DirtyWorld, DryFrictionTakesTheSameFromEachHalfCycleAndThenHolds) {
  const Effects friction = {{"coulomb_friction", {{"f_c", 0.4}}}};
  auto run = decay(0.03, 3.0);
  run.step = std::numbers::pi / 320.0;  // 32 samples a half cycle
  const Channels c = moved(Device({{"c", 0.0}, {"k", 100.0}}, friction, false), friction, run);
  EXPECT_NEAR(c.response.at(32), -0.022, 1e-7);
  EXPECT_NEAR(c.response.at(64), 0.014, 1e-7);
  EXPECT_NEAR(c.response.at(96), -0.006, 1e-7);
  EXPECT_NEAR(c.response.at(128), -0.002, 1e-7);
  EXPECT_NEAR(c.response.back(), -0.002, 1e-7);
}

// Newton's second law for the sprung mass and the tyre together: the table carries both masses.
TEST(DirtyWorld, ATyreCarriesBothMassesAtRest) {
  const Effects tyre = {{"tyre", {{"r", 0.1}, {"k_t", 5000.0}, {"c_t", 5.0}}}};
  const Device device({{"theta1", 15.0}, {"theta2", 1.5}, {"theta3", 5.3}, {"theta4", 1.1}}, tyre,
                      true);
  State rate;
  const State rest = device.at_rest(device.rest());
  EXPECT_NEAR(5000.0 * rest[kTyre], 1.1 * kGravity, 1e-9);
  EXPECT_NEAR(device.acceleration(rest, 0.0, 0.0, {}, rate), 0.0, 1e-6);
  EXPECT_NEAR(rate[kTyreRate], 0.0, 1e-6);
}

TEST(DirtyWorld, ACampaignFollowsFromItsSeedAndPlaceAlone) {
  if (kSanitized) GTEST_SKIP() << kOfTheTests;
  const Campaign first = drawn(7, 16);
  drawn(7, 3);
  const Campaign again = drawn(7, 16);
  EXPECT_EQ(first.effects, again.effects);
  EXPECT_EQ(first.visible, again.visible);
  EXPECT_NE(first.base, drawn(8, 16).base);
}

// The unknown is smaller than the largest effect, and each effect shows above the noise.
TEST(DirtyWorld, WhatIsHiddenIsOfTheIntendedSize) {
  if (kSanitized) GTEST_SKIP() << kOfTheTests;
  for (const long index : {13L, 21L}) {
    const Campaign c = drawn(1, index);
    ASSERT_EQ(c.unknown.size(), 1U) << index;
    ASSERT_FALSE(c.effects.empty()) << index;
    double largest = 0.0;
    for (const auto& [name, parameters] : c.effects)
      largest = std::max(largest, c.visible.at(name));
    EXPECT_GT(largest, c.noise.response) << index;
    EXPECT_GT(c.visible.at(c.unknown.begin()->first), 0.0) << index;
    EXPECT_LT(c.visible.at(c.unknown.begin()->first), 1.3 * largest) << index;
  }
}

}  // namespace
}  // namespace shaker::dirty
