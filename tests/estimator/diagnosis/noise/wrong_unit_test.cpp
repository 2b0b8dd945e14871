#include "estimator/diagnosis/noise/internal/wrong_unit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/noise/internal/transient.hpp"
#include "tests/estimator/diagnosis/campaigns.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using ::testing::HasSubstr;

FitOptions from_rest_in_units() {
  FitOptions options;
  options.from_rest = true;
  return options;
}

void times(std::vector<double>& values, double factor) {
  for (double& value : values)
    value *= factor;
}

std::string trouble_with(const Campaign& campaign) {
  const auto look = screen_campaign(campaign, estimator::testing::oleo(), from_rest_in_units());
  return look ? "" : look.error().what;
}

TEST(WrongUnit, HasNothingToSayOfARigAsItShouldBe) {
  EXPECT_EQ(trouble_with(testing::recorded({}, testing::kSixRuns, 3)), "");
  EXPECT_EQ(trouble_with(testing::recorded({{"coulomb_friction", 0.4}}, testing::kSixRuns, 3)), "");
}

TEST(WrongUnit, NamesTheRunsThatCountInMillimetres) {
  Campaign campaign = testing::recorded({}, testing::kSixRuns, 3);
  times(campaign.runs[3].displacement, 1e3);
  EXPECT_THAT(trouble_with(campaign), HasSubstr("in run r4 the displacement does not count"));
  EXPECT_THAT(trouble_with(campaign), HasSubstr("millimetres that are called metres"));
  times(campaign.runs[4].displacement, 1e3);
  EXPECT_THAT(trouble_with(campaign), HasSubstr("in run r4, r5 the displacement"));
}

TEST(WrongUnit, NamesInchesAndAccelerationsOfGravityInEveryRun) {
  Campaign inches = testing::recorded({}, testing::kSixRuns, 3);
  Campaign gravities = inches;
  for (Recording& run : inches.runs)
    times(run.displacement, 0.0254);
  EXPECT_THAT(trouble_with(inches), HasSubstr("metres that are called inches"));
  for (Recording& run : gravities.runs)
    times(run.excitation, 1.0 / 9.80665);
  EXPECT_THAT(trouble_with(gravities), HasSubstr("g that are called m/s^2"));
}

// Along 0.1 + 0.03 sin: the forces of the model at its start values, times `factor`.
Campaign on_a_dynamometer(double factor) {
  Campaign campaign;
  for (const double frequency : {1.0, 2.0}) {
    Recording run;
    run.name = "d" + std::to_string(static_cast<int>(frequency));
    run.kind = Kind::imposed_motion;
    run.frequency_hz = frequency;
    const double omega = 2.0 * std::numbers::pi * frequency;
    for (int i = 0; i < 800; ++i) {
      const double t = i / (61.7 * frequency), u = 0.1 + 0.03 * std::sin(omega * t);
      const double v = 0.03 * omega * std::cos(omega * t);
      run.t.push_back(t);
      run.displacement.push_back(u + 1e-6 * std::sin(37.0 * i));
      run.force.push_back(factor * (15.0 * std::fabs(v) * v + 1.5 / (1.0 - 5.3 * u) - 9.8 +
                                    1e-3 * std::sin(91.0 * i)));
    }
    campaign.runs.push_back(run);
  }
  return campaign;
}

TEST(WrongUnit, RefusesForcesOfAnotherUnitOrSign) {
  EXPECT_EQ(trouble_with(on_a_dynamometer(1.0)), "");
  EXPECT_THAT(trouble_with(on_a_dynamometer(1e3)), HasSubstr("the force does not count"));
  EXPECT_THAT(trouble_with(on_a_dynamometer(-1.0)), HasSubstr("gives out energy"));
}

TEST(WrongUnit, RefusesForcesOfAnotherSignAlongMotionsWithoutAPeriod) {
  for (const double factor : {1.0, -1.0}) {
    Campaign campaign = on_a_dynamometer(factor);
    for (Recording& run : campaign.runs)
      run.frequency_hz = 0.0;
    const auto runs = transient_runs(campaign.runs, estimator::testing::oleo());
    EXPECT_EQ(runs.ok(), factor > 0.0);
    EXPECT_THAT(runs ? "" : runs.error().what, HasSubstr(factor > 0.0 ? "" : "gives out energy"));
  }
}

TEST(WrongUnit, RefusesAnImposedMotionInMillimetres) {
  Campaign campaign = on_a_dynamometer(1.0);
  for (Recording& run : campaign.runs)
    times(run.displacement, 1e3);
  EXPECT_THAT(trouble_with(campaign), HasSubstr("millimetres that are called metres"));
}

// A fit accepts the forces as they are.
TEST(WrongUnit, RefusesNoForcesForStartValuesThatAreFarOff) {
  for (const double factor : {0.0, 1.0 / 286.0, 286.0}) {
    auto model = estimator::testing::oleo();
    model.effects[0].parameters["theta1"].start = factor * 15.0;
    model.effects[1].parameters["theta2"].start = std::max(factor * 1.5, 1e-9);
    const auto look = screen_campaign(on_a_dynamometer(1.0), model, from_rest_in_units());
    EXPECT_TRUE(look) << factor << ": " << look.error().what;
  }
}

TEST(WrongUnit, DoubtsAForceOnlyWhereTheModelStatesItsSize) {
  for (const bool stated : {true, false}) {
    auto dashpot = estimator::testing::effect("viscous_damping");
    if (stated) dashpot.parameters["c"].start = 1e-6;
    const auto look = screen_campaign(
        on_a_dynamometer(1e5), estimator::testing::model_of({dashpot}), from_rest_in_units());
    ASSERT_TRUE(look) << look.error().what;
    EXPECT_EQ(std::any_of(look->warnings.begin(), look->warnings.end(),
                          [](const std::string& text) {
                            return text.find("far from what the start values") != text.npos;
                          }),
              stated);
  }
}

TEST(WrongUnit, NamesTheRunsThatAreDrivenInGravities) {
  for (const std::vector<std::size_t>& which :
       {std::vector<std::size_t>{2}, std::vector<std::size_t>{0, 3}}) {
    Campaign campaign = testing::recorded({}, testing::kSixRuns, 3);
    std::string names;
    for (const std::size_t r : which) {
      times(campaign.runs[r].excitation, 1.0 / 9.80665);
      names += (names.empty() ? "" : ", ") + campaign.runs[r].name;
    }
    EXPECT_THAT(trouble_with(campaign), HasSubstr("in run " + names + " the excitation"));
    EXPECT_THAT(trouble_with(campaign), HasSubstr("g that are called m/s^2"));
  }
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
