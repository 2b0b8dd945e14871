#include "estimator/diagnosis/noise/internal/screening.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "tests/estimator/diagnosis/campaigns.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

Screening looked(const Campaign& campaign) {
  FitOptions options;
  options.from_rest = true;
  auto first = screen_campaign(campaign, estimator::testing::oleo(), options);
  EXPECT_TRUE(first) << first.error().what;
  return first ? std::move(*first) : Screening{};
}

Campaign with(const std::map<std::string, double>& truth, std::uint64_t seed = 5) {
  return testing::recorded(truth, testing::kSixRuns, seed);
}

void add_drift(Campaign& campaign, double rate) {
  for (Recording& run : campaign.runs) {
    for (std::size_t i = 0; i < run.t.size(); ++i)
      run.displacement[i] += rate * (run.t[i] - run.t.front());
  }
}

void round_off(Campaign& campaign, double quantisation_step) {
  for (Recording& run : campaign.runs) {
    for (double& u : run.displacement)
      u = quantisation_step * std::round(u / quantisation_step);
  }
}

const NamedEffect* find(const Diagnosis& d, const std::string& name) {
  for (const NamedEffect& effect : d.effects) {
    if (effect.name == name) return &effect;
  }
  return nullptr;
}

Diagnosis diagnosed_quickly(const Campaign& campaign) {
  const auto d = diagnose(campaign, estimator::testing::oleo());
  EXPECT_TRUE(d) << d.error().what;
  return d ? *d : Diagnosis{};
}

TEST(Screening, ReadsADriftAndTakesItOut) {
  Campaign campaign = with({});
  add_drift(campaign, 2e-5);
  const Screening first = looked(campaign);
  ASSERT_TRUE(first.drift.found);
  EXPECT_NEAR(first.drift.rate, 2e-5, 4.0 * first.drift.standard_error);
  EXPECT_LT(first.drift.standard_error, 5e-7);
  EXPECT_TRUE(first.drift.rival.empty()) << first.drift.rival;
  ASSERT_TRUE(first.with_drift);
  const Screening plain = looked(with({}));
  for (std::size_t r = 0; r < plain.look.runs.size(); ++r) {
    EXPECT_EQ(first.look.runs[r].cycles(), plain.look.runs[r].cycles());
    const double time = first.look.runs[r].when.mean();
    EXPECT_NEAR(first.look.runs[r].mean()[0], plain.look.runs[r].mean()[0],
                4.0 * first.drift.standard_error * time);
  }
}

TEST(Screening, TakesNoDriftOutWhereThereIsNone) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Screening first = looked(with({}, seed));
    EXPECT_FALSE(first.drift.found) << seed;
    EXPECT_FALSE(first.with_drift);
  }
}

// The pressure falls by about a per cent in a minute, so the damper sinks like a drifting
// sensor.
TEST(Screening, DoesNotBlameTheSensorForAGasThatLeaks) {
  const Screening first = looked(with({{"gas_leak", 2e-4}}));
  EXPECT_FALSE(first.drift.found);
  EXPECT_THAT(first.warnings, Contains(HasSubstr("the damper itself changes")));
}

TEST(Screening, DoesNotBlameTheSensorForOilThatWarms) {
  EXPECT_FALSE(looked(with({{"oil_warming", 0.5}})).drift.found);
}

TEST(Screening, NamesTheDriftWithItsRate) {
  Campaign campaign = with({});
  add_drift(campaign, -3e-5);
  const Diagnosis d = diagnosed_quickly(campaign);
  EXPECT_EQ(d.verdict, Verdict::explained);
  ASSERT_EQ(d.effects.size(), 1U);
  EXPECT_EQ(d.effects[0].name, "sensor_drift");
  EXPECT_GT(d.effects[0].probability, 0.95);
  const ParameterEstimate& rate = d.effects[0].parameters.at(0);
  EXPECT_NEAR(rate.value, -3e-5, 4.0 * rate.standard_error);
  EXPECT_LT(rate.lower, rate.value);
  EXPECT_EQ(rate.unit, "m/s");
  EXPECT_GT(d.gap.before, 5.0 * d.gap.noise_floor);
  EXPECT_LT(d.gap.after, 1.1 * d.gap.noise_floor);
  EXPECT_EQ(d.improved.effects.back().effect, "sensor_drift");
}

TEST(Screening, ADriftDoesNotHideFriction) {
  Campaign campaign = with({{"pressure_friction", 0.005}});
  add_drift(campaign, 3e-5);
  const Diagnosis d = diagnosed_quickly(campaign);
  EXPECT_EQ(d.verdict, Verdict::explained);
  ASSERT_NE(find(d, "sensor_drift"), nullptr);
  const NamedEffect* friction = find(d, "pressure_friction");
  ASSERT_NE(friction, nullptr);
  EXPECT_NEAR(friction->parameters.at(0).value, 0.005, 1e-4);
}

TEST(Screening, NamesACoarseSensorAndBlamesTheDamperForNothing) {
  for (const double quantisation_step : {2e-4, 5e-4}) {
    Campaign campaign = with({});
    round_off(campaign, quantisation_step);
    const Diagnosis d = diagnosed_quickly(campaign);
    EXPECT_EQ(d.verdict, Verdict::explained) << quantisation_step;
    ASSERT_EQ(d.effects.size(), 1U) << quantisation_step;
    EXPECT_EQ(d.effects[0].name, "sensor_quantisation");
    EXPECT_NEAR(d.effects[0].parameters.at(0).value, quantisation_step, 1e-9);
  }
}

TEST(Screening, NoiseBlursAFineGrid) {
  Campaign campaign = with({});  // noise of 20 um
  round_off(campaign, 2e-5);
  const Diagnosis d = diagnosed_quickly(campaign);
  EXPECT_EQ(d.verdict, Verdict::adequate);
  EXPECT_TRUE(d.effects.empty());
}

TEST(Screening, ACoarseSensorDoesNotHideFriction) {
  Campaign campaign = with({{"pressure_friction", 0.02}});
  round_off(campaign, 2e-4);
  const Diagnosis d = diagnosed_quickly(campaign);
  EXPECT_EQ(d.verdict, Verdict::explained);
  EXPECT_NE(find(d, "sensor_quantisation"), nullptr);
  const NamedEffect* friction = find(d, "pressure_friction");
  ASSERT_NE(friction, nullptr);
  EXPECT_NEAR(friction->parameters.at(0).value, 0.02, 1e-3);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
