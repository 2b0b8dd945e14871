#include "estimator/diagnosis/diagnose.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/report/internal/stated.hpp"
#include "estimator/model/model.hpp"
#include "tests/estimator/diagnosis/campaigns.hpp"
#include "tests/estimator/fixtures.hpp"
#include "tests/sanitized.hpp"

namespace shaker::estimator::diagnosis {
namespace {

Diagnosis diagnosed(const std::map<std::string, double>& truth, std::uint64_t seed = 5,
                    const DiagnoseOptions& options = {}) {
  const auto found = diagnose(testing::recorded(truth, testing::kSixRuns, seed),
                              estimator::testing::oleo(), options);
  EXPECT_TRUE(found) << found.error().what;
  return found ? *found : Diagnosis{};
}

TEST(Diagnose, NamesNothingWhereNothingIsMissing) {
  DiagnoseOptions loose;
  loose.false_alarm_rate = 0.1;
  loose.draws = 2000;
  int alarms = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed)
    alarms += diagnosed({}, seed, loose).verdict == Verdict::adequate ? 0 : 1;
  // 10 campaigns at a rate of 10 %: more than 4 alarms have a probability of 0.2 %.
  EXPECT_LE(alarms, 4);
  const Diagnosis quiet = diagnosed({});
  EXPECT_EQ(quiet.verdict, Verdict::adequate);
  EXPECT_TRUE(quiet.effects.empty());
  EXPECT_LT(quiet.gap.before, 1.2 * quiet.gap.noise_floor);
}

// From distant start values the fit of the response may end with the spring at its bound, or
// fail. The forces along the measured motion give a better start.
TEST(Diagnose, NamesNothingWhereOnlyTheStartValuesAreOff) {
  for (const double damping : some({0.4, 1.6, 6.0})) {
    const Campaign campaign = testing::recorded({{"theta1", damping}, {"theta2", 80.0}},
                                                {{2.0, 1.0}, {3.0, 2.0}, {4.0, 2.0}}, 5, "linear");
    for (const double times : {0.1, 3.0, 10.0}) {
      auto model = estimator::testing::linear_oscillator();
      model.effects[0].parameters["c"].start = damping * times;
      model.effects[1].parameters["k"].start = 80.0 * times;
      const auto found = diagnose(campaign, model);
      ASSERT_TRUE(found) << damping << " x " << times << ": " << found.error().what;
      EXPECT_EQ(found->verdict, Verdict::adequate) << damping << " x " << times;
      EXPECT_TRUE(found->effects.empty());
    }
  }
}

TEST(Diagnose, NamesSealFrictionSharpAsItIs) {
  const Diagnosis d = diagnosed({{"pressure_friction", 0.005}});
  EXPECT_EQ(d.verdict, Verdict::explained);
  ASSERT_FALSE(d.effects.empty());
  EXPECT_EQ(d.effects[0].name, "pressure_friction");
  ASSERT_EQ(d.effects[0].parameters.size(), 1U);
  EXPECT_NEAR(d.effects[0].parameters[0].value, 0.005, 5e-5);
  EXPECT_LT(d.gap.after, 1.1 * d.gap.noise_floor);
  EXPECT_GT(d.gap.before, 50.0 * d.gap.noise_floor);
  ASSERT_TRUE(d.gap.held_out_after);
  EXPECT_LT(*d.gap.held_out_after, 0.05 * *d.gap.held_out_before);
}

TEST(Diagnose, NamesFrictionWithMemory) {
  const Diagnosis d = diagnosed({{"presliding_friction", 0.1}});
  EXPECT_EQ(d.verdict, Verdict::explained);
  ASSERT_EQ(d.effects.size(), 1U);
  EXPECT_EQ(d.effects[0].name, "presliding_friction");
  EXPECT_NEAR(d.effects[0].parameters[0].value, 0.1, 1e-3);
  EXPECT_GT(d.effects[0].probability, 0.9);
}

TEST(Diagnose, TellsDryFrictionFromWhatLooksLikeIt) {
  const Diagnosis d = diagnosed({{"coulomb_friction", 0.05}});
  EXPECT_EQ(d.verdict, Verdict::explained);
  ASSERT_EQ(d.effects.size(), 1U);
  EXPECT_EQ(d.effects[0].name, "coulomb_friction");
  EXPECT_NEAR(d.effects[0].parameters[0].value, 0.05, 5e-4);
}

// The base parameters imitate most of this effect, with either sign. A fit that ends with the
// wrong sign leaves a residual that a cubic spring would explain.
TEST(Diagnose, NamesARealGasOnTheRightSideOfAnIdealOne) {
  const auto d = diagnose(testing::recorded({{"gas_virial", 0.02}},
                                            {{2.0, 3.0}, {3.0, 6.0}, {4.5, 6.0}, {6.0, 12.0}}, 5),
                          estimator::testing::oleo());
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "real_gas");
  ASSERT_EQ(d->effects[0].parameters.size(), 1U);
  EXPECT_NEAR(d->effects[0].parameters[0].value, 0.02, 0.001);
}

// The search adds a static peak to the valve and does not try dry friction instead.
TEST(Diagnose, NamesTheSimplerOfTwoThatDoTheSame) {
  const auto d =
      diagnose(testing::recorded({{"coulomb_friction", 0.2}, {"rebound_factor", 1.5}},
                                 {{1.0, 3.0}, {2.0, 1.5}, {2.0, 4.0}, {4.0, 6.0}}, 6, "oleo", 1e-4),
               estimator::testing::oleo());
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  std::vector<std::string> names;
  for (const NamedEffect& effect : d->effects) {
    names.push_back(effect.name);
    EXPECT_GT(effect.probability, 0.95) << effect.name;
  }
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("coulomb_friction", "rebound_damping"));
}

TEST(Diagnose, BlamesTheInstrumentForItsOwnFault) {
  const Diagnosis d = diagnosed({{"sensor_delay", 0.003}});
  EXPECT_EQ(d.verdict, Verdict::explained);
  ASSERT_FALSE(d.effects.empty());
  const auto& first = d.effects[0];
  const bool in_set = first.name == "sensor_delay" ||
                      std::find(first.confusable_with.begin(), first.confusable_with.end(),
                                "sensor_delay") != first.confusable_with.end();
  EXPECT_TRUE(in_set) << first.name;
}

TEST(Diagnose, WritesAModelThatHoldsWhatItNamed) {
  const Diagnosis d = diagnosed({{"pressure_friction", 0.005}});
  const Model improved(d.improved);
  EXPECT_EQ(improved.parameter_count(), 5);
  const auto start = improved.start();
  EXPECT_NEAR(start[4], 0.005, 5e-5);
  // The missing effect changed the base parameters; with it they are right again.
  EXPECT_NEAR(start[0], 16.6667, 0.02);
  EXPECT_GT(std::fabs(d.parameters_before[0].value - 16.6667), 0.1);
}

TEST(Diagnose, PredictsRunsThatAreHeldOut) {
  Campaign campaign = testing::recorded({{"pressure_friction", 0.01}}, testing::kSixRuns, 9);
  campaign.runs[1].role = campaign.runs[4].role = Role::held_out;
  const auto d = diagnose(campaign, estimator::testing::oleo());
  ASSERT_TRUE(d) << d.error().what;
  ASSERT_FALSE(d->effects.empty());
  EXPECT_EQ(d->effects[0].name, "pressure_friction");
  ASSERT_TRUE(d->effects[0].held_out_gain);
  EXPECT_GT(*d->effects[0].held_out_gain, 0.9);
}

bool holds(const NamedEffect& set, const std::string& effect) {
  const auto& others = set.confusable_with;
  return set.name == effect || std::find(others.begin(), others.end(), effect) != others.end();
}

// The discriminating run is made, and then the indistinguishable set is smaller.
TEST(Diagnose, AsksForTheRunThatTellsRivalsApart) {
  const std::map<std::string, double> truth = {{"coulomb_friction", 0.0007}};
  std::vector<testing::Setting> settings = {{2.0, 3.0}, {2.0, 2.0}};
  const auto few = diagnose(testing::recorded(truth, settings, 5), estimator::testing::oleo());
  ASSERT_TRUE(few && !few->effects.empty());
  const NamedEffect& unsure = few->effects[0];
  EXPECT_TRUE(holds(unsure, "coulomb_friction")) << unsure.name;
  EXPECT_GE(unsure.confusable_with.size(), 4U);
  ASSERT_TRUE(unsure.discriminating_run);
  EXPECT_TRUE(unsure.discriminating_run->channel.empty());
  EXPECT_GE(unsure.discriminating_run->separation, 3.0);

  settings.push_back(
      {unsure.discriminating_run->frequency_hz, unsure.discriminating_run->amplitude});
  const auto more = diagnose(testing::recorded(truth, settings, 5), estimator::testing::oleo());
  ASSERT_TRUE(more && !more->effects.empty());
  EXPECT_TRUE(holds(more->effects[0], "coulomb_friction")) << more->effects[0].name;
  EXPECT_LT(more->effects[0].confusable_with.size(), unsure.confusable_with.size());
  EXPECT_GT(more->effects[0].probability, unsure.probability);
}

// A sensor that reads lengths too large looks like an inertia that is too small in every run.
TEST(Diagnose, AsksForAnAccelerometerWhereNoRunTells) {
  const Diagnosis d = diagnosed({{"sensor_gain", 0.95}});
  ASSERT_FALSE(d.effects.empty());
  EXPECT_TRUE(holds(d.effects[0], "sensor_gain")) << d.effects[0].name;
  EXPECT_TRUE(holds(d.effects[0], "added_mass")) << d.effects[0].name;
  ASSERT_TRUE(d.effects[0].discriminating_run);
  EXPECT_EQ(d.effects[0].discriminating_run->channel, "acceleration");
}

TEST(Diagnose, IsDeterministic) {
  const Diagnosis a = diagnosed({{"pressure_friction", 0.005}});
  const Diagnosis b = diagnosed({{"pressure_friction", 0.005}});
  EXPECT_EQ(a.probability_before, b.probability_before);
  EXPECT_EQ(a.chi_squared_after, b.chi_squared_after);
}

TEST(Diagnose, SaysWhatOneRunCannotTell) {
  const auto d = diagnose(testing::recorded({}, {{2.0, 3.0}}, 3), estimator::testing::oleo());
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_FALSE(d->gap.held_out_before);
  EXPECT_THAT(d->warnings, ::testing::Contains(::testing::HasSubstr("one run only")));
}

// The noise is so large that any model passes.
TEST(Diagnose, SaysNothingOfMotionsThatTheNoiseHides) {
  Campaign campaign = testing::recorded({}, {{2.0, 3.0}, {3.0, 6.0}}, 3);
  std::mt19937_64 source(8);
  std::normal_distribution<double> normal(0.0, 0.5);
  for (Recording& run : campaign.runs) {
    for (double& u : run.displacement)
      u += normal(source);
  }
  const auto d = diagnose(campaign, estimator::testing::oleo());
  ASSERT_FALSE(d);
  EXPECT_THAT(d.error().what, ::testing::HasSubstr("no run stands out of its noise"));
}

TEST(Diagnose, RefusesRunsThatContradictEachOther) {
  Campaign campaign = testing::recorded({}, {{2.0, 3.0}, {3.0, 6.0}}, 3);
  Campaign warm = testing::recorded({{"theta2", 1.7}}, {{2.0, 3.0}}, 4);
  warm.runs[0].name = "r3";
  campaign.runs.push_back(warm.runs[0]);
  const auto d = diagnose(campaign, estimator::testing::oleo());
  ASSERT_FALSE(d);
  EXPECT_THAT(d.error().what, ::testing::HasSubstr("contradict"));
}

TEST(Diagnose, RefusesAModelWithAnUnknownEffect) {
  auto model = estimator::testing::oleo();
  model.effects.push_back(estimator::testing::effect("phlogiston"));
  const auto d = diagnose(testing::recorded({}, {{2.0, 3.0}}, 3), model);
  ASSERT_FALSE(d);
  EXPECT_THAT(d.error().what, ::testing::HasSubstr("phlogiston"));
}

TEST(Diagnose, RefusesAnEmptyCampaignAndASenselessRate) {
  EXPECT_FALSE(diagnose({}, estimator::testing::oleo()));
  DiagnoseOptions options;
  options.false_alarm_rate = 0.0;
  EXPECT_FALSE(
      diagnose(testing::recorded({}, {{2.0, 3.0}}, 3), estimator::testing::oleo(), options));
  DiagnoseOptions idle;
  idle.evaluation_budget = 0.0;
  EXPECT_FALSE(diagnose(testing::recorded({}, {{2.0, 3.0}}, 3), estimator::testing::oleo(), idle));
}

// Three effects at once; a short search finds the one that explains most.
TEST(Diagnose, EndsWhereItsEffortDoesAndSaysSo) {
  const std::map<std::string, double> truth = {
      {"coulomb_friction", 0.2}, {"rebound_factor", 1.5}, {"sensor_delay", 4e-3}};
  DiagnoseOptions brief, thorough;
  brief.evaluation_budget = 1e6;
  thorough.evaluation_budget = kThorough;
  const auto goes_on = ::testing::Contains(::testing::HasSubstr("--thorough goes on"));
  const Diagnosis first = diagnosed(truth, 5, brief);
  EXPECT_TRUE(first.cut_short);
  EXPECT_EQ(first.verdict, Verdict::unexplained);
  EXPECT_FALSE(first.effects.empty());
  EXPECT_THAT(first.warnings, goes_on);
  EXPECT_LT(first.gap.after, 0.9 * first.gap.before);
  const Diagnosis whole = diagnosed(truth, 5, thorough);
  EXPECT_THAT(whole.warnings, ::testing::Not(goes_on));
  EXPECT_LE(whole.gap.after, first.gap.after);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
