#include "config/model.hpp"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shaker::config {
namespace {

const std::filesystem::path kModelExamples =
    std::filesystem::path(SHAKER_SOURCE_DIR) / "config" / "examples";

TEST(Model, OfTheOleoIsReadAsItIsWritten) {
  const auto model = load_model(kModelExamples / "model-oleo.json");
  ASSERT_TRUE(model) << model.error().what;
  EXPECT_EQ(model->name, "oleo");
  EXPECT_DOUBLE_EQ(model->gravity, 9.80665);
  ASSERT_EQ(model->effects.size(), 3u);
  EXPECT_EQ(model->effects[1].effect, "gas_spring");
  const ParameterSpec& theta4 = model->effects[1].parameters.at("theta4");
  EXPECT_DOUBLE_EQ(*theta4.upper, 2.0);
  EXPECT_FALSE(theta4.fixed);
  EXPECT_FALSE(model->effects[0].parameters.at("theta1").upper.has_value());
}

TEST(Model, MayCountInMillimetres) {
  const auto with = [](const std::string& unit, double gravity) {
    return parse_model(R"({"name": "m", "effects": [{"effect": "gravity"}], "length_unit": )" +
                           unit + R"(, "gravity": )" + std::to_string(gravity) + "}",
                       "m.json");
  };
  EXPECT_TRUE(with(R"("mm")", 9806.65)) << with(R"("mm")", 9806.65).error().what;
  EXPECT_FALSE(with(R"("m")", 9806.65));
  EXPECT_FALSE(with(R"("mm")", 2e6));
  EXPECT_EQ(with(R"("µm")", 9.8e6)->length_unit, "um") << "one name for each unit";

  const auto refused = with(R"("ticks")", 9806.65);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what,
              testing::HasSubstr(
                  "/length_unit: \"ticks\" is no unit of length; known are m, cm, mm, um, in, ft, "
                  "and of an angle rad, mrad, deg. For one that only this model uses, say "
                  "{\"label\": \"ticks\"}"));
  const auto own = with(R"({"label": "ticks"})", 9806.65);
  ASSERT_TRUE(own) << own.error().what;
  EXPECT_EQ(parse_model(to_json_text(*own), "again")->length_unit, "ticks");
}

TEST(Model, SurvivesBeingWrittenAndReadAgain) {
  ModelSpec model;
  model.name = "all \"quoted\" things";
  model.gravity = 32.2;
  model.length_unit = "ft";
  ParameterSpec parameter;
  parameter.start = 0.1 + 0.2;  // all 17 digits count
  parameter.lower = -1e-300;
  parameter.upper = 1e300;
  parameter.fixed = true;
  parameter.prior_mean = 1.0 / 3.0;
  parameter.prior_standard_deviation = 0.01;
  EffectSpec gas;
  gas.effect = "gas_spring";
  gas.parameters = {{"theta2", parameter}, {"theta3", {}}, {"theta4", {}}};
  gas.parameters["theta3"].variation.per = "group";
  gas.parameters["theta4"].variation = {"", "1/gas_temperature", 293.15};
  gas.constants = {{"u0", 0.25}};
  gas.sees = {1, -1};
  gas.acts = {0.5, 0};
  gas.in_series = true;
  EffectSpec gravity;
  gravity.effect = "gravity";
  gravity.sees = {1, 0};
  gravity.acts = {1, 1};
  model.effects = {gas, gravity};
  model.coordinates = {"sprung", "unsprung"};
  model.mass = {1, 0, 0, 0.125};
  model.excitation = {1, 1};
  model.observed = "unsprung";
  const auto again = parse_model(to_json_text(model), "again");
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_EQ(again->name, model.name);
  EXPECT_EQ(again->length_unit, "ft");
  EXPECT_EQ(again->gravity, model.gravity);
  ASSERT_EQ(again->effects.size(), 2u);
  const ParameterSpec& read = again->effects[0].parameters.at("theta2");
  EXPECT_EQ(read.start, parameter.start);
  EXPECT_EQ(read.lower, parameter.lower);
  EXPECT_EQ(read.upper, parameter.upper);
  EXPECT_TRUE(read.fixed);
  EXPECT_EQ(read.prior_mean, parameter.prior_mean);
  EXPECT_EQ(read.prior_standard_deviation, parameter.prior_standard_deviation);
  EXPECT_FALSE(again->effects[0].parameters.at("theta3").start.has_value());
  EXPECT_EQ(again->effects[0].parameters.at("theta3").variation.per, "group");
  const RunVariation& variation = again->effects[0].parameters.at("theta4").variation;
  EXPECT_EQ(variation.condition(), "gas_temperature");
  EXPECT_TRUE(variation.inverse());
  EXPECT_EQ(variation.reference, 293.15);
  EXPECT_EQ(again->effects[0].constants.at("u0"), 0.25);
  EXPECT_EQ(again->effects[0].sees, gas.sees);
  EXPECT_EQ(again->effects[0].acts, gas.acts);
  EXPECT_TRUE(again->effects[0].in_series);
  EXPECT_FALSE(again->effects[1].in_series);
  EXPECT_EQ(again->coordinates, model.coordinates);
  EXPECT_EQ(again->mass, model.mass);
  EXPECT_EQ(again->excitation, model.excitation);
  EXPECT_EQ(again->observed, "unsprung");
  EXPECT_EQ(to_json_text(*again), to_json_text(model));
}

TEST(Model, MayHoldAnEffectThatAnInputDrives) {
  const std::string text =
      R"({"name": "magnetorheological", "effects": [
          {"effect": "coulomb_friction", "parameters": {"f_c": {"start": 2.0}}},
          {"effect": "coulomb_friction", "input": "current", "reference": 0.5,
           "parameters": {"f_c": {"start": 9.0}}}]})";
  const auto model = parse_model(text, "m.json");
  ASSERT_TRUE(model) << model.error().what;
  EXPECT_EQ(model->effects[0].effect, "coulomb_friction");
  EXPECT_EQ(model->effects[1].effect, "coulomb_friction over current");
  EXPECT_EQ(model->effects[1].reference, 0.5);
  EXPECT_EQ(driven(model->effects[1].effect).effect, "coulomb_friction");
  EXPECT_EQ(driven(model->effects[1].effect).input, "current");
  EXPECT_EQ(driven("coulomb_friction").input, "");
  const auto again = parse_model(to_json_text(*model), "again");
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_EQ(again->effects[1].effect, "coulomb_friction over current");
  EXPECT_EQ(again->effects[1].reference, 0.5);
  EXPECT_FALSE(again->effects[0].reference);
}

}  // namespace
}  // namespace shaker::config
