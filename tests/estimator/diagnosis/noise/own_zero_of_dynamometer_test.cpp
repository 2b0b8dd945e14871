// Runs of a dynamometer with preloads, or zeros of the load cell, of their own.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

using Force = std::function<double(double, double)>;  // per unit mass, of stroke and velocity

struct Dwell {
  double frequency_hz, amplitude, preload;
};

Recording imposed(const Force& force, const Dwell& dwell, std::uint64_t seed) {
  constexpr double kRate = 400.0, kCycles = 16.0, kNoise = 0.02;
  std::mt19937_64 source(seed);
  std::normal_distribution<double> noise(0.0, kNoise);
  Recording run;
  run.name = "r" + std::to_string(seed);
  run.kind = Kind::imposed_motion;
  run.frequency_hz = dwell.frequency_hz;
  const double omega = 2.0 * std::numbers::pi * dwell.frequency_hz;
  for (int i = 0; i < static_cast<int>(kCycles * kRate / dwell.frequency_hz); ++i) {
    const double t = i / kRate, u = dwell.amplitude * std::cos(omega * t);
    const double v = -dwell.amplitude * omega * std::sin(omega * t);
    run.t.push_back(t);
    run.displacement.push_back(u);
    run.force.push_back(force(u, v) + dwell.preload + noise(source));
  }
  return run;
}

Diagnosis diagnosed(const Force& force, const std::vector<double>& preloads) {
  constexpr Dwell kDwells[] = {
      {0.7, 0.02, 0.0}, {1.3, 0.03, 0.0}, {2.1, 0.015, 0.0}, {2.9, 0.025, 0.0}};
  Campaign campaign;
  for (std::size_t r = 0; r < preloads.size(); ++r) {
    Dwell dwell = kDwells[r];
    dwell.preload = preloads[r];
    campaign.runs.push_back(imposed(force, dwell, r + 1));
  }
  const auto d = diagnose(campaign, estimator::testing::linear_oscillator());
  EXPECT_TRUE(d) << d.error().what;
  return d ? *d : Diagnosis{};
}

double damper(double u, double v) {
  return 60.0 * u + 8.0 * v;
}

const std::vector<double> kAlike = {0.0, 0.0, 0.0, 0.0}, kOwn = {4.0, -7.0, 2.0, -1.0};

TEST(OwnZeroOfDynamometer, IsToldAndIsNoMissingEffect) {
  const Diagnosis d = diagnosed(damper, kOwn);
  EXPECT_EQ(d.verdict, Verdict::adequate);
  EXPECT_THAT(d.warnings, Contains(HasSubstr("the runs differ in their zero or preload by 4.8")));
  EXPECT_LT(d.gap.before, 0.02);  // of the noise's 0.02 a cycle
}

TEST(OwnZeroOfDynamometer, HidesNothing) {
  const Diagnosis d =
      diagnosed([](double u, double v) { return damper(u, v) + 0.8 * std::tanh(v / 5e-4); }, kOwn);
  ASSERT_FALSE(d.effects.empty());
  EXPECT_EQ(d.effects[0].name, "coulomb_friction");
  EXPECT_NEAR(d.effects[0].parameters.at(0).value, 0.8, 0.01);
  EXPECT_LT(d.gap.after, 0.05 * d.gap.before);
  EXPECT_THAT(d.warnings, Contains(HasSubstr("differ in their zero or preload")));
}

// Damping of one direction has a mean force, and a larger one in a faster run.
TEST(OwnZeroOfDynamometer, IsNotWhatAOneSidedForceMakes) {
  for (const auto& preloads : {kAlike, kOwn}) {
    const Diagnosis d = diagnosed(
        [](double u, double v) { return damper(u, v) + 3.0 * std::fmax(v, 0.0); }, preloads);
    ASSERT_EQ(d.effects.size(), 1U);
    EXPECT_EQ(d.effects[0].name, "one_sided_damping");
    EXPECT_EQ(d.verdict, Verdict::explained);
    EXPECT_NEAR(d.effects[0].parameters.at(0).value, 3.0, 0.05);
  }
}

TEST(OwnZeroOfDynamometer, ThatAllRunsShareIsNotTold) {
  const Diagnosis d = diagnosed(damper, {3.0, 3.0, 3.0, 3.0});
  EXPECT_NE(d.verdict, Verdict::adequate);
  EXPECT_THAT(d.warnings, Not(Contains(HasSubstr("differ in their zero"))));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
