#include "estimator/diagnosis/noise/internal/extra_channels.hpp"

#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "estimator/diagnosis/noise/internal/weighing.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

struct Faults {
  double sensor_gain = 1.0, exciter_gain = 1.0;
};

// A linear oscillator in closed form, its accelerometer and its load cell.
Campaign measured(const Faults& faults) {
  std::mt19937_64 source(11);
  std::normal_distribution<double> normal;
  const double c = 2.0, k = 100.0;
  Campaign campaign;
  for (const double frequency : {0.8, 1.3, 2.1, 3.2}) {
    Recording r;
    r.name = "r" + std::to_string(campaign.runs.size());
    r.frequency_hz = frequency;
    const double omega = 2.0 * std::numbers::pi * frequency;
    const std::complex<double> i(0.0, 1.0);
    const std::complex<double> u = 2.0 * faults.exciter_gain / (k - omega * omega + i * omega * c);
    for (int n = 0; n < 12 * 150; ++n) {
      const double t = n / (150.0 * frequency);
      const std::complex<double> turn = std::exp(i * omega * t);
      const auto noisy = [&](std::complex<double> phasor, double noise) {
        return (phasor * turn).real() + noise * normal(source);
      };
      r.t.push_back(t);
      r.excitation.push_back((2.0 * turn).real());
      r.displacement.push_back(noisy(faults.sensor_gain * u, 1e-5));
      r.acceleration.push_back(noisy(-omega * omega * u, 5e-3));
      r.force.push_back(noisy((k + i * omega * c) * u, 5e-3));
    }
    campaign.runs.push_back(std::move(r));
  }
  return campaign;
}

Diagnosis diagnosed(const Campaign& campaign) {
  auto model = estimator::testing::linear_oscillator();
  model.effects[0].parameters["c"].start = 3.0;
  model.effects[1].parameters["k"].start = 120.0;
  const auto d = diagnose(campaign, model);
  EXPECT_TRUE(d) << d.error().what;
  return d ? *d : Diagnosis{};
}

TEST(ExtraChannels, AnAccelerometerTellsAGainFromAMass) {
  Campaign campaign = measured({.sensor_gain = 1.05});
  for (Recording& run : campaign.runs)
    run.force.clear();
  const Diagnosis with = diagnosed(campaign);
  ASSERT_FALSE(with.effects.empty());
  EXPECT_EQ(with.effects[0].name, "sensor_gain");
  EXPECT_THAT(with.effects[0].confusable_with, Not(Contains("added_mass")));
  EXPECT_NEAR(with.effects[0].parameters.at(0).value, 1.05, 0.01);
  EXPECT_THAT(with.warnings, Contains(HasSubstr("against the table")));
  EXPECT_EQ(with.runs.size(), campaign.runs.size());
}

TEST(ExtraChannels, ALoadCellTellsTheExcitersGainFromTheSensors) {
  Campaign campaign = measured({.exciter_gain = 1.05});
  for (Recording& run : campaign.runs)
    run.acceleration.clear();
  const Diagnosis with = diagnosed(campaign);
  ASSERT_FALSE(with.effects.empty());
  EXPECT_EQ(with.effects[0].name, "exciter_gain");
  EXPECT_THAT(with.effects[0].confusable_with, Not(Contains("sensor_gain")));
}

TEST(ExtraChannels, NothingIsMissingWhereNothingIs) {
  const Diagnosis d = diagnosed(measured({}));
  EXPECT_EQ(d.verdict, Verdict::adequate);
  EXPECT_THAT(d.warnings, Contains(HasSubstr("channel force is used")));
}

// With ten times too much damping the model does not predict what an accelerometer should show.
TEST(ExtraChannels, AreHeldAgainstTheMotionAndNotAgainstTheModel) {
  std::vector<SteadyRun> runs;
  for (const Recording& run : measured({}).runs)
    runs.push_back(steady_cycles(run).value());
  auto model = estimator::testing::linear_oscillator();
  model.effects[0].parameters["c"].start = 20.0;
  model.effects[0].parameters["c"].fixed = true;
  FitOptions far;
  far.from_rest = true;
  const std::vector<RunDatum> data = weigh(runs).data;
  const HarmonicFit fit = fit_harmonics(model, data, {}, nullptr, far);
  ASSERT_TRUE(fit.trouble.empty()) << fit.trouble;
  std::vector<std::string> told;
  EXPECT_EQ(extra_channels(runs, fit, data, told).size(), 2 * runs.size());
  EXPECT_THAT(told, Contains(HasSubstr("acceleration of the mass against the table")));
}

TEST(ExtraChannels, AChannelThatIsSomethingElseIsNotUsed) {
  Campaign campaign = measured({});
  for (Recording& run : campaign.runs) {
    run.acceleration.clear();
    for (double& value : run.force)
      value = -value;
  }
  const Diagnosis d = diagnosed(campaign);
  EXPECT_EQ(d.verdict, Verdict::adequate);
  EXPECT_THAT(d.warnings, Contains(HasSubstr("check its sign")));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
