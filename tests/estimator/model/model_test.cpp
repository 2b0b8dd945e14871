#include "estimator/model/model.hpp"

#include <stdexcept>

#include <gmock/gmock.h>

#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using ::testing::HasSubstr;

std::string refusal(const config::ModelSpec& spec) {
  try {
    const Model model(spec);
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "";
}

TEST(Model, NumbersTheParametersInTheOrderOfItsEffects) {
  const Model model(testing::oleo());
  ASSERT_EQ(model.parameter_count(), 4);
  EXPECT_EQ(model.parameters()[0].name, "theta1");
  EXPECT_EQ(model.parameters()[3].name, "theta4");
  EXPECT_EQ(model.parameters()[3].effect, "gas_spring");
  EXPECT_EQ(model.parameters()[0].unit, "1/m");
}

TEST(Model, RelabelsUnitsForModelsInFeet) {
  auto spec = testing::oleo(32.174);
  spec.length_unit = "ft";
  const Model model(spec);
  EXPECT_EQ(model.parameters()[0].unit, "1/ft");
  EXPECT_EQ(model.parameters()[1].unit, "ft/s^2");
  EXPECT_EQ(model.parameters()[3].unit, "-");
}

TEST(Model, GivesTwoParametersOfOneSymbolNamesOfTheirOwn) {
  const Model model(
      testing::model_of({testing::effect("viscous_damping"), testing::effect("viscous_damping")}));
  EXPECT_NE(model.parameters()[0].name, model.parameters()[1].name);
}

TEST(Model, SaysWhichEffectItDoesNotKnowAndWhichThereAre) {
  auto spec = testing::oleo();
  spec.origin = "oleo.json";
  spec.effects[1].effect = "gas_sprong";
  const std::string why = refusal(spec);
  EXPECT_THAT(why, HasSubstr("oleo.json: /effects/1"));
  EXPECT_THAT(why, HasSubstr("gas_sprong"));
  EXPECT_THAT(why, HasSubstr("gas_spring"));
}

TEST(Model, RefusesUnknownParametersContradictoryBoundsAndStartsOutside) {
  auto spec = testing::oleo();
  spec.effects[0].parameters["theta7"] = {};
  EXPECT_THAT(refusal(spec), HasSubstr("no parameter 'theta7'; it has theta1"));
  spec = testing::oleo();
  spec.effects[0].parameters["theta1"].lower = 5.0;
  spec.effects[0].parameters["theta1"].upper = 2.0;
  EXPECT_THAT(refusal(spec), HasSubstr("above the upper bound"));
  spec = testing::oleo();
  spec.effects[0].parameters["theta1"].start = -1.0;
  EXPECT_THAT(refusal(spec), HasSubstr("outside its bounds"));
  spec = testing::oleo();
  spec.effects.clear();
  EXPECT_THAT(refusal(spec), HasSubstr("at least one effect"));
}

TEST(Model, HasOnePartInSeriesAndNoOtherEffectThere) {
  auto joint = testing::effect("series_compliance");
  joint.in_series = true;
  const Model model(testing::model_of({testing::effect("viscous_damping"), joint}));
  EXPECT_EQ(model.coordinates(), 2);
  joint.in_series = false;
  EXPECT_EQ(Model(testing::model_of({testing::effect("viscous_damping"), joint})).coordinates(), 1);
  joint.in_series = true;
  EXPECT_THAT(refusal(testing::model_of(
                  {testing::effect("viscous_damping"), testing::effect("free_play"), joint})),
              HasSubstr("a load path has one"));
  auto spec = testing::oleo();
  spec.effects[0].in_series = true;
  EXPECT_THAT(refusal(spec),
              HasSubstr("/effects/0/in_series: orifice_damping is no part in series"));
}

}  // namespace
}  // namespace shaker::estimator
