// Friction and the smoothing width over which it changes its sign.
#include <cmath>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "tests/estimator/diagnosis/campaigns.hpp"
#include "tests/estimator/fixtures.hpp"
#include "tests/sanitized.hpp"

namespace shaker::estimator::diagnosis {
namespace {

// An oleo with friction of a smoothing width, f_c tanh(v / e), integrated by Runge-Kutta.
Campaign with_gentle_friction(double f_c, double e) {
  const std::vector<double>& theta = estimator::testing::kOleoSi;
  std::mt19937_64 source(3);
  std::normal_distribution<double> noise(0.0, 2e-5), noise_of_table(0.0, 1e-3);
  Campaign campaign;
  for (const testing::Setting& set : testing::kSixRuns) {
    Recording run;
    run.name = "r" + std::to_string(campaign.runs.size() + 1);
    run.frequency_hz = set.frequency_hz;
    run.amplitude = set.amplitude;
    const double omega = 2.0 * std::numbers::pi * set.frequency_hz;
    const auto acceleration = [&](double t, double u, double v) {
      return set.amplitude * std::cos(omega * t) - theta[0] * std::fabs(v) * v -
             theta[1] * std::pow(1.0 - theta[2] * u, -theta[3]) + 9.80665 - f_c * std::tanh(v / e);
    };
    constexpr int kSteps = 20;
    const double h = 1.0 / (997.0 * kSteps);
    double u = (1.0 - theta[1] / 9.80665) / theta[2], v = 0.0;
    for (int i = 0; i < kSteps * static_cast<int>(997.0 * 24.0 / set.frequency_hz); ++i) {
      const double t = i * h;
      if (i % kSteps == 0) {
        run.t.push_back(t);
        run.displacement.push_back(u + noise(source));
        run.excitation.push_back(set.amplitude * std::cos(omega * t) + noise_of_table(source));
      }
      const double a1 = acceleration(t, u, v);
      const double v2 = v + 0.5 * h * a1, a2 = acceleration(t + 0.5 * h, u + 0.5 * h * v, v2);
      const double v3 = v + 0.5 * h * a2, a3 = acceleration(t + 0.5 * h, u + 0.5 * h * v2, v3);
      const double v4 = v + h * a3, a4 = acceleration(t + h, u + h * v3, v4);
      u += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
      v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
    }
    campaign.runs.push_back(std::move(run));
  }
  return campaign;
}

// Friction with the smoothing width of the catalogue: a jump would leave more than noise.
TEST(Diagnose, NamesFrictionThatTurnsRoundAsTheCatalogueSays) {
  const auto found = diagnose(with_gentle_friction(0.2, 5e-3), estimator::testing::oleo());
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_EQ(found->verdict, Verdict::explained);
  ASSERT_EQ(found->effects.size(), 1U);
  EXPECT_EQ(found->effects[0].name, "coulomb_friction");
  const auto& friction = found->effects[0].parameters.at(0);
  EXPECT_NEAR(friction.value, 0.2, 5.0 * friction.standard_error);
  // The catalogue's own is that for the median motion of its world, another one is found.
  ASSERT_EQ(found->effects[0].parameters.size(), 2U);
  const auto& width = found->effects[0].parameters[1];
  EXPECT_NEAR(width.value, 5e-3, 5.0 * width.standard_error);
  EXPECT_EQ(found->improved.effects.back().constants.at("e"), width.value);
}

double width_of(const config::EffectSpec& line) {
  const auto stated = line.constants.find("e");
  return stated == line.constants.end() ? 0.0 : stated->second;
}

// The smoothing width is neither the catalogue's nor zero: it is found together with the
// friction.
TEST(Diagnose, FindsTheWidthOverWhichFrictionTurnsRound) {
  for (const double e : some({3e-3, 1e-3, 2e-3, 7e-3, 10e-3})) {
    SCOPED_TRACE(e);
    const auto found = diagnose(with_gentle_friction(0.2, e), estimator::testing::oleo());
    ASSERT_TRUE(found) << found.error().what;
    EXPECT_EQ(found->verdict, Verdict::explained);
    ASSERT_EQ(found->effects.size(), 1U);
    EXPECT_EQ(found->effects[0].name, "coulomb_friction");
    ASSERT_EQ(found->effects[0].parameters.size(), 2U);
    const auto& friction = found->effects[0].parameters[0];
    const auto& width = found->effects[0].parameters[1];
    EXPECT_NEAR(friction.value, 0.2, 5.0 * friction.standard_error);
    EXPECT_EQ(width.name, "e");
    EXPECT_NEAR(width.value, e, 5.0 * width.standard_error);
    EXPECT_LT(width.standard_error, 0.1 * e);
    EXPECT_EQ(width_of(found->improved.effects.back()), width.value);
  }
}

// The model file contains the friction, with the smoothing width of the data or without one.
TEST(Diagnose, NamesNothingWhereTheModelHoldsTheFrictionAndItsWidth) {
  const Campaign campaign = with_gentle_friction(0.2, 2e-3);
  auto model = estimator::testing::oleo();
  model.effects.push_back(estimator::testing::effect("coulomb_friction"));
  for (const bool stated : {true, false}) {
    SCOPED_TRACE(stated);
    if (stated) model.effects.back().constants["e"] = 2e-3;
    if (!stated) model.effects.back().constants.clear();
    const auto found = diagnose(campaign, model);
    ASSERT_TRUE(found) << found.error().what;
    EXPECT_EQ(found->verdict, Verdict::adequate);
    EXPECT_TRUE(found->effects.empty());
    EXPECT_NEAR(width_of(found->improved.effects.back()), 2e-3, 2e-4);
  }
}

// A wrong smoothing width in the model file is corrected and reported, and no other effect is
// named for it.
TEST(Diagnose, MendsAWidthThatTheModelStatesWrongly) {
  const Campaign campaign = with_gentle_friction(0.2, 2e-3);
  auto model = estimator::testing::oleo();
  model.effects.push_back(estimator::testing::effect("coulomb_friction"));
  for (const double stated : some({1e-3, 1.5e-3, 3e-3, 5e-3})) {
    SCOPED_TRACE(stated);
    model.effects.back().constants["e"] = stated;
    const auto found = diagnose(campaign, model);
    ASSERT_TRUE(found) << found.error().what;
    EXPECT_EQ(found->verdict, Verdict::adequate);
    EXPECT_NEAR(width_of(found->improved.effects.back()), 2e-3, 2e-4);
    EXPECT_THAT(found->warnings,
                ::testing::Contains(::testing::HasSubstr("turns round over e = 0.00")));
  }
}

// The improved model states a friction of zero smoothing width, and a second diagnosis keeps
// it.
TEST(Diagnose, WritesFrictionThatTurnsRoundAtOnceAsSuch) {
  const auto campaign = testing::recorded({{"coulomb_friction", 0.2}}, testing::kSixRuns, 5);
  const auto found = diagnose(campaign, estimator::testing::oleo());
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_EQ(found->verdict, Verdict::explained);
  const double width = width_of(found->improved.effects.back());
  EXPECT_GT(width, 0.0);
  EXPECT_LE(width, 5e-4 * 0.6);  // of the largest speed
  const auto again = diagnose(campaign, found->improved);
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_EQ(again->verdict, Verdict::adequate);
  EXPECT_EQ(width_of(again->improved.effects.back()), width);
}

// Dry friction is a jump, which the model file smooths: no effect is missing.
TEST(Diagnose, NamesNothingWhereTheModelHoldsTheFriction) {
  auto model = estimator::testing::oleo();
  model.effects.push_back(estimator::testing::effect("coulomb_friction"));
  const auto found =
      diagnose(testing::recorded({{"coulomb_friction", 0.2}}, testing::kSixRuns, 5), model);
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_EQ(found->verdict, Verdict::adequate);
  EXPECT_TRUE(found->effects.empty());
  EXPECT_LT(found->gap.after, 1.1 * found->gap.noise_floor);
}

// At rest nothing tells a stiff damper from a stuck one: the base model ends as a damper without a spring,
// far from anything that friction could better by a little.
TEST(Diagnose, NamesFrictionThatHoldsHalfOfTheRunsAtRest) {
  const std::vector<testing::Setting> settings = {{0.9, 1.8}, {1.3, 2.6}, {1.6, 4.9},
                                                  {2.0, 3.2}, {2.4, 4.6}, {3.7, 4.5}};
  const auto found =
      diagnose(testing::recorded({{"theta1", 2.2}, {"theta2", 96.0}, {"coulomb_friction", 3.4}},
                                 settings, 5, "linear", 7e-5),
               estimator::testing::linear_oscillator());
  ASSERT_TRUE(found) << found.error().what;
  ASSERT_FALSE(found->effects.empty());
  EXPECT_EQ(found->effects[0].name, "coulomb_friction");
  EXPECT_NEAR(found->effects[0].parameters.at(0).value, 3.4, 0.2);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
