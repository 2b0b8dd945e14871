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

// Beside what is missing these zeros are less than a tenth of the gap. They are found once it is named.
TEST(OwnZeroOfDynamometer, IsFoundBesideAForceThatHidesIt) {
  const Diagnosis d =
      diagnosed([](double u, double v) { return damper(u, v) + 40.0 * std::fabs(v) * v; },
                {0.05, -0.08, 0.04, -0.01});
  ASSERT_EQ(d.effects.size(), 1U);
  EXPECT_EQ(d.effects[0].name, "orifice_damping");
  EXPECT_EQ(d.verdict, Verdict::explained);
  EXPECT_THAT(d.warnings, Contains(HasSubstr("the runs differ in their zero or preload by 0.06")));
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

TEST(OwnZeroOfDynamometer, ThatAllRunsShareIsToldToo) {
  const Diagnosis d = diagnosed(damper, {3.0, 3.0, 3.0, 3.0});
  EXPECT_EQ(d.verdict, Verdict::adequate);
  EXPECT_THAT(d.warnings, Contains(HasSubstr("preloads, about +3 m/s^2 (r1 +3, r2 +3")));
}

// A seal on a hundred newtons of gas, in one record without a period.
Campaign under_preload(const std::function<double(double)>& way, double friction) {
  constexpr double kRate = 200.0, kNoise = 0.01;
  std::mt19937_64 source(7);
  std::normal_distribution<double> noise(0.0, kNoise);
  Recording run;
  run.name = "r";
  run.kind = Kind::imposed_motion;
  for (int i = 0; i < 2400; ++i) {
    const double t = i / kRate, h = 1e-6, v = (way(t + h) - way(t - h)) / (2.0 * h);
    run.t.push_back(t);
    run.displacement.push_back(way(t));
    run.force.push_back(100.0 + 8.0 * v + friction * std::tanh(v / 1e-4) + noise(source));
  }
  Campaign campaign;
  campaign.runs.push_back(std::move(run));
  return campaign;
}

config::ModelSpec viscous() {
  config::ModelSpec model = estimator::testing::linear_oscillator();
  std::erase_if(model.effects, [](const auto& e) { return e.effect != "viscous_damping"; });
  return model;
}

TEST(OwnZeroOfDynamometer, OfTheOnlyRecordIsNoSpring) {
  const auto there_and_back = [](double t) {
    return 0.02 * std::sin(1.7 * t) + 0.012 * std::sin(4.3 * t + 1.0);
  };
  const auto d = diagnose(under_preload(there_and_back, 2.0), viscous());
  ASSERT_TRUE(d) << d.error().what;
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "coulomb_friction");
  EXPECT_NEAR(d->effects[0].parameters.at(0).value, 2.0, 0.02);
  EXPECT_THAT(d->warnings,
              Contains(::testing::ContainsRegex("a preload, of \\+(99\\.[5-9]|100) m")));
  const auto nothing = diagnose(under_preload(there_and_back, 0.0), viscous());
  ASSERT_TRUE(nothing) << nothing.error().what;
  EXPECT_EQ(nothing->verdict, Verdict::adequate);
}

// Nobody can tell a preload from dry friction that never turns.
TEST(OwnZeroOfDynamometer, OfAMotionToOneSideMayBeFriction) {
  const auto forth = [](double t) { return 0.03 * t + 0.004 * std::sin(3.0 * t); };
  const auto d = diagnose(under_preload(forth, 0.0), viscous());
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_NE(d->verdict, Verdict::adequate);
  EXPECT_THAT(d->warnings, Not(Contains(HasSubstr("a zero of its own"))));
  // Nor is it a spring whose place of rest the motion never reaches.
  for (const NamedEffect& effect : d->effects) {
    for (const ParameterEstimate& p : effect.parameters) {
      EXPECT_TRUE(p.name != "u0" || (p.value >= -0.01 && p.value <= 0.37)) << p.value;
    }
  }
}

// A joint that turns at one speed in each run. The means of its runs are friction and damping.
TEST(OwnZeroOfDynamometer, OfRunsAtOneSpeedEachIsFriction) {
  constexpr double kRate = 200.0, kNoise = 0.02;
  std::mt19937_64 source(11);
  std::normal_distribution<double> noise(0.0, kNoise);
  Campaign campaign;
  for (const double speed : {0.1, 0.2, 0.35, 0.5, 0.8, 1.1}) {
    Recording run;
    run.name = "w" + std::to_string(campaign.runs.size());
    run.kind = Kind::imposed_motion;
    for (int i = 0; i < 1000; ++i) {
      const double t = i / kRate;
      const double v = speed * (1.0 + 0.1 * std::sin(5.0 * t));
      run.t.push_back(t);
      run.displacement.push_back(speed * (t - 0.02 * std::cos(5.0 * t)));
      run.force.push_back(1.3 * std::tanh(v / 1e-4) + 0.76 * v + noise(source));
    }
    campaign.runs.push_back(std::move(run));
  }
  const auto d = diagnose(campaign, viscous());
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_THAT(d->warnings, Not(Contains(HasSubstr("differ in their zero or preload"))));
  ASSERT_FALSE(d->effects.empty());
  EXPECT_EQ(d->effects[0].name, "coulomb_friction");
  EXPECT_NEAR(d->effects[0].parameters.at(0).value, 1.3, 0.02);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
