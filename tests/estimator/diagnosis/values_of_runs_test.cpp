// Parameters that have a value of their own in each run or group of runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "tests/estimator/diagnosis/campaigns.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

const std::vector<double> kCharge = {1.50, 1.50, 1.62, 1.62, 1.56, 1.56};  // m/s^2, of each run

// An oleo whose gas was charged anew before every second run.
Campaign charged_anew(double friction) {
  Campaign campaign;
  for (std::size_t i = 0; i < kCharge.size(); ++i) {
    Campaign one = testing::recorded({{"theta2", kCharge[i]}, {"coulomb_friction", friction}},
                                     {testing::kSixRuns[i]}, 100 + i);
    one.runs[0].name = "r" + std::to_string(i + 1);
    one.runs[0].condition.group = i < 2 ? "first" : i < 4 ? "second" : "third";
    campaign.runs.push_back(std::move(one.runs[0]));
  }
  return campaign;
}

config::ModelSpec oleo_with_charge_per(const std::string& what) {
  config::ModelSpec model = estimator::testing::oleo();
  for (config::EffectSpec& line : model.effects) {
    if (line.effect == "gas_spring") line.parameters["theta2"].variation.per = what;
  }
  return model;
}

void expect_charges(const std::vector<ParameterEstimate>& found,
                    const std::map<std::string, double>& charges) {
  std::size_t met = 0;
  for (const ParameterEstimate& p : found) {
    const auto charge = charges.find(p.name);
    if (charge == charges.end()) continue;
    ++met;
    EXPECT_NEAR(p.value, charge->second, 4.0 * p.standard_error) << p.name;
    EXPECT_LT(p.standard_error, 0.01) << p.name;
  }
  EXPECT_EQ(met, charges.size());
}

TEST(ValuesOfRuns, ExplainWhatNoEffectDoes) {
  const auto as_one = diagnose(charged_anew(0.0), estimator::testing::oleo());
  ASSERT_TRUE(as_one) << as_one.error().what;
  EXPECT_NE(as_one->verdict, Verdict::adequate);
  const auto d = diagnose(charged_anew(0.0), oleo_with_charge_per("run"));
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::adequate);
  expect_charges(
      d->parameters_before,
      {{"theta2[r1]", 1.50}, {"theta2[r2]", 1.50}, {"theta2[r3]", 1.62}, {"theta2[r6]", 1.56}});
}

TEST(ValuesOfRuns, HideNoFriction) {
  for (const char* what : {"run", "group"}) {
    const auto d = diagnose(charged_anew(0.2), oleo_with_charge_per(what));
    ASSERT_TRUE(d) << d.error().what;
    EXPECT_EQ(d->verdict, Verdict::explained) << what;
    ASSERT_EQ(d->effects.size(), 1U) << what;
    EXPECT_EQ(d->effects[0].name, "coulomb_friction") << what;
    EXPECT_NEAR(d->effects[0].parameters.at(0).value, 0.2, 0.01) << what;
    if (std::string(what) == "group")
      expect_charges(d->parameters_after,
                     {{"theta2[first]", 1.50}, {"theta2[second]", 1.62}, {"theta2[third]", 1.56}});
  }
}

// A drop is one more run: its charge is one like these.
TEST(ValuesOfRuns, AreOneNumberOfTheDamperThatScatters) {
  const auto d = diagnose(charged_anew(0.0), oleo_with_charge_per("group"));
  ASSERT_TRUE(d) << d.error().what;
  ASSERT_FALSE(d->damper.hypotheses.empty());
  const DamperHypothesis& h = d->damper.hypotheses[0];
  ASSERT_EQ(h.covariance.size(), h.numbers.size() * h.numbers.size());
  int met = 0;
  for (std::size_t i = 0; i < h.numbers.size(); ++i) {
    if (h.numbers[i].symbol != "theta2") continue;
    ++met;
    EXPECT_NEAR(value_of(h.model, h.numbers[i]), 1.56, 0.02);
    // The standard deviation of 1.50, 1.62 and 1.56 is 0.06.
    EXPECT_NEAR(std::sqrt(h.covariance[i * h.numbers.size() + i]), 0.06, 0.01);
  }
  EXPECT_EQ(met, 1);
  EXPECT_EQ(Model(h.model).parameters().size(), h.numbers.size());
}

TEST(ValuesOfRuns, ARunThatNoOtherTellsOfIsFitted) {
  Campaign campaign = charged_anew(0.0);
  campaign.runs[5].role = Role::held_out;
  const auto d = diagnose(campaign, oleo_with_charge_per("run"));
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_THAT(d->warnings,
              ::testing::Contains(::testing::HasSubstr("run r6 is fitted and not held out")));
  const auto of_group = diagnose(campaign, oleo_with_charge_per("group"));
  ASSERT_TRUE(of_group) << of_group.error().what;
  EXPECT_TRUE(of_group->gap.held_out_before);
}

TEST(ValuesOfRuns, OfARunThatIsLeftOutIsNotDetermined) {
  Campaign campaign = charged_anew(0.0);
  for (auto* column :
       {&campaign.runs[3].t, &campaign.runs[3].displacement, &campaign.runs[3].excitation})
    column->resize(40);
  const auto d = diagnose(campaign, oleo_with_charge_per("run"));
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::adequate);
  for (const ParameterEstimate& p : d->parameters_before)
    EXPECT_EQ(p.determined, p.name != "theta2[r4]") << p.name;
  ASSERT_FALSE(d->damper.hypotheses.empty());
  const DamperHypothesis& h = d->damper.hypotheses[0];
  for (const ModelNumber& number : h.numbers) {
    if (number.symbol == "theta2") {
      EXPECT_NEAR(value_of(h.model, number), 1.548, 0.002);
    }
  }
}

TEST(ValuesOfRuns, ARunWithoutAGroupIsNamed) {
  Campaign campaign = charged_anew(0.0);
  campaign.runs[2].condition.group = "";
  const auto d = diagnose(campaign, oleo_with_charge_per("group"));
  ASSERT_FALSE(d);
  EXPECT_THAT(d.error().what,
              ::testing::HasSubstr("theta2 has a value per group, and run r3 has no \"group\""));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
