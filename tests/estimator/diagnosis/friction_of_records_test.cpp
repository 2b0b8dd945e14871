// Friction in free decays, and the width over which it changes its sign.
#include <algorithm>
#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/estimate_campaign.hpp"
#include "tests/estimator/diagnosis/records.hpp"
#include "tests/estimator/diagnosis/two_decays.hpp"
#include "tests/sanitized.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

// An estimate lies within three of its standard errors, and these are less than a tenth of it.
void expect_near(const NamedEffect& effect, const std::string& name, double truth) {
  for (const ParameterEstimate& p : effect.parameters) {
    if (p.name != name) continue;
    EXPECT_NEAR(p.value, truth, 3.0 * p.standard_error) << name;
    EXPECT_LT(p.standard_error, 0.1 * p.value) << name;
    return;
  }
  ADD_FAILURE() << "no " << name;
}

// The record's own width is about 7 mm/s.
TEST(FrictionOfRecords, IsNamedWhateverTheWidthOverWhichItReverses) {
  for (const double width : some({5e-4, 5e-3, 4e-2})) {
    SCOPED_TRACE(width);
    const auto d = testing::diagnosis_of_decays(
        [&](double u, double v) { return 400.0 * u + 0.4 * v + 0.3 * std::tanh(v / width); });
    ASSERT_TRUE(d) << d.error().what;
    EXPECT_EQ(d->verdict, Verdict::explained);
    ASSERT_EQ(d->effects.size(), 1U);
    EXPECT_EQ(d->effects[0].name, "coulomb_friction");
    expect_near(d->effects[0], "f_c", 0.3);
    expect_near(d->effects[0], "e", width);
  }
}

TEST(FrictionOfRecords, ThatIsLargerAtSlowMotionIsNamedBesideAGentleReversal) {
  const auto d = testing::diagnosis_of_decays([](double u, double v) {
    const double slow = std::exp(-(v / 0.1) * (v / 0.1));
    return 400.0 * u + 0.4 * v + 0.3 * (1.0 + 0.6 * slow) * std::tanh(v / 0.04);
  });
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "stribeck_friction");
  expect_near(d->effects[0], "ratio", 1.6);
  expect_near(d->effects[0], "v_s", 0.1);
  expect_near(d->effects[0], "e", 0.04);
}

// The mass comes to rest where the friction holds the spring, 1 to 4 mm off its centre.
TEST(FrictionOfRecords, ThatHoldsTheMassOffItsCentreIsNamedAloneAndBesideDrag) {
  for (const double drag : some({0.0, 2.0})) {
    SCOPED_TRACE(drag);
    const auto d = testing::diagnosis_of_sticking_decays(
        [&](double u, double v) { return 40.0 * u + 0.3 * v + drag * std::fabs(v) * v; }, 0.12);
    ASSERT_TRUE(d) << d.error().what;
    EXPECT_EQ(d->verdict, Verdict::explained);
    ASSERT_EQ(d->effects.size(), drag > 0.0 ? 2U : 1U);
    for (const NamedEffect& effect : d->effects) {
      if (effect.name == "coulomb_friction")
        expect_near(effect, "f_c", 0.12);
      else
        expect_near(effect, "theta1", drag);
    }
    EXPECT_THAT(d->warnings, Not(Contains(HasSubstr("constant force"))));  // friction explains it
  }
}

// What comes out of a diagnosis goes into an estimate: its friction jumps there too.
TEST(FrictionOfRecords, ThatJumpsIsEstimatedFromTheImprovedModel) {
  const auto campaign =
      testing::sticking_decays([](double u, double v) { return 40.0 * u + 0.3 * v; }, 0.12);
  const auto d = diagnose(campaign, estimator::testing::linear_oscillator());
  ASSERT_TRUE(d) << d.error().what;
  const auto estimate = estimate_campaign(campaign, d->improved);
  ASSERT_TRUE(estimate) << estimate.error().what;
  EXPECT_TRUE(estimate->intervals_hold);
  EXPECT_LT(estimate->gap.size, estimate->gap.noise_floor);
  const auto f_c = std::ranges::find(estimate->parameters, "f_c", &ParameterEstimate::name);
  ASSERT_NE(f_c, estimate->parameters.end());
  EXPECT_NEAR(f_c->value, 0.12, 3.0 * f_c->standard_error);
}

// Half of the weight: the base model, which lacks it, is far from the drops. Its gas column bends to
// imitate the larger one, as far as a bound.
TEST(FrictionOfRecords, IsNamedInDropsWithMuchOfIt) {
  for (const double friction : some({4.5, 5.0})) {
    SCOPED_TRACE(friction);
    const testing::Truth hidden = {{"coulomb_friction", friction}};
    auto model = estimator::testing::oleo();
    model.effects[1].parameters["theta4"].lower = 0.5;
    model.effects[1].parameters["theta4"].upper = 2.0;
    const auto d = diagnose(
        testing::campaign_of({testing::drop(hidden, 1.2, 11), testing::drop(hidden, 1.8, 12),
                              testing::drop(hidden, 2.4, 13), testing::drop(hidden, 2.1, 14)},
                             1),
        model);
    ASSERT_TRUE(d) << d.error().what;
    ASSERT_FALSE(d->effects.empty());
    EXPECT_THAT(d->effects[0].name, HasSubstr("friction"));
    EXPECT_LT(d->gap.after, 0.3 * d->gap.before);
    EXPECT_TRUE(friction < 5.0 ||
                std::any_of(d->parameters_before.begin(), d->parameters_before.end(),
                            [](const ParameterEstimate& p) { return p.at_bound; }));
  }
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
