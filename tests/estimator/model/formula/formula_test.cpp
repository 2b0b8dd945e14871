#include <cmath>
#include <stdexcept>

#include <gmock/gmock.h>

#include "config/model.hpp"
#include "estimator/fit/estimation.hpp"
#include "estimator/model/formula/formula_effect.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using ::testing::HasSubstr;

config::ModelSpec parsed(const std::string& effects) {
  const auto model = config::parse_model(
      R"j({"format": "shaker-model/1", "name": "own", "effects": [)j" + effects + "]}", "own.json");
  if (!model) throw std::runtime_error(model.error().what);
  return *model;
}

const std::string kOleoByFormula = R"j(
  {"effect": "my_orifice", "formula": "theta1 * abs(v) * v",
   "parameters": {"theta1": {"start": 16.6667, "lower": 0, "unit": "1/m"}}},
  {"effect": "my_gas", "formula": "theta2 * (1 - theta3 * u)^(-theta4)",
   "parameters": {"theta2": {"start": 1.524, "lower": 0}, "theta3": {"start": 5.31496, "lower": 0},
                  "theta4": {"start": 1.1, "lower": 0.1}}},
  {"effect": "gravity"})j";
const std::string kOleo = R"j(
  {"effect": "orifice_damping", "parameters": {"theta1": {"start": 16.6667}}},
  {"effect": "gas_spring",
   "parameters": {"theta2": {"start": 1.524}, "theta3": {"start": 5.31496}, "theta4": {"start": 1.1}}},
  {"effect": "gravity"})j";

// Expects equal periodic solutions and sensitivities of both models.
void expect_same(const std::string& one, const std::string& other) {
  const Model a(parsed(one)), b(parsed(other));
  ASSERT_EQ(a.parameter_count(), b.parameter_count());
  PeriodicSystem first(a, {Scheme::order6, 97, true}), second(b, {Scheme::order6, 97, true});
  for (PeriodicSystem* system : {&first, &second}) {
    system->set_excitation(2.0, 3.0);
    ASSERT_EQ(system->solve_from_rest(system->model().start()).status, SolveStatus::converged);
  }
  for (int k = 0; k < a.parameter_count(); ++k) {
    const auto& names = b.parameters();
    int same = -1;
    for (int m = 0; m < b.parameter_count(); ++m)
      same = names[m].name == a.parameters()[k].name ? m : same;
    ASSERT_GE(same, 0) << a.parameters()[k].name;
    for (int i = 0; i < 97; ++i) {
      EXPECT_NEAR(first.observed(i), second.observed(i), 1e-11);
      const double slope = second.observed_row(i)[1 + same];
      EXPECT_NEAR(first.observed_row(i)[1 + k], slope, 1e-9 * (1.0 + std::fabs(slope)));
    }
  }
}

TEST(FormulaEffect, OfTheOleoIsTheOleoKinkIncluded) {
  expect_same(kOleoByFormula, kOleo);
}

TEST(FormulaEffect, WithAStateIsTheCatalogueEffectOfThatKind) {
  expect_same(kOleo + R"j(, {"effect": "my_seal", "formula": "f_c * s",
                "states": {"s": {"rate": "(v - smooth_abs(v, e) * s) / z0"}},
                "parameters": {"f_c": {"start": 0.4}, "z0": {"start": 0.003}},
                "constants": {"e": 0.001}})j",
              kOleo + R"j(, {"effect": "presliding_friction",
                "parameters": {"f_c": {"start": 0.4}, "z0": {"start": 0.003}}})j");
}

TEST(FormulaEffect, BorrowsParametersOfOtherEffects) {
  expect_same(
      kOleo + R"j(, {"effect": "my_friction",
                "formula": "mu * theta2 * exp(-theta4 * log(1 - theta3 * u)) * tanh(v / e)",
                "borrows": {"theta2": "gas_spring", "theta3": "gas_spring", "theta4": "gas_spring"},
                "parameters": {"mu": {"start": 0.03}}, "constants": {"e": 0.005}})j",
      kOleo + R"j(, {"effect": "pressure_friction", "parameters": {"mu": {"start": 0.03}}})j");
}

TEST(FormulaEffect, KnowsTheSmoothedEdgesOfTheCatalogue) {
  expect_same(
      kOleo +
          R"j(, {"effect": "my_stop", "formula": "k * ramp(u - u_s, 0.001) + d * step(u - u_s, 0.001) * v",
                "parameters": {"k": {"start": 500}, "d": {"start": 3}, "u_s": {"start": 0.15}}})j",
      kOleo + R"j(, {"effect": "end_stop",
                "parameters": {"k": {"start": 500}, "d": {"start": 3}, "u_s": {"start": 0.15}}})j");
}

TEST(FormulaEffect, IsInadmissibleWhereItHasNoFiniteValue) {
  config::EffectSpec spec = testing::effect("wall");
  spec.formula = "log(1 - u)";
  const auto effect = make_formula_effect(spec);
  alignas(64) double u[8] = {0.5, 0.9, 1.5, 0, 0, 0, 0, 0}, zero[8] = {}, f[4][8] = {};
  Points points;
  points.u = u;
  points.v = points.a = points.x = zero;
  Forces forces;
  forces.f = f[0];
  forces.f_u = f[1];
  forces.f_v = f[2];
  forces.f_a = f[3];
  points.n = 2;
  EXPECT_TRUE(effect->evaluate(points, nullptr, nullptr, forces));
  EXPECT_NEAR(f[0][1], std::log(0.1), 1e-14);
  EXPECT_NEAR(f[1][1], -10.0, 1e-12);
  points.n = 3;
  EXPECT_FALSE(effect->evaluate(points, nullptr, nullptr, forces));
}

std::string refusal(const std::string& formula, const std::string& further = "") {
  try {
    const Model model(parsed(R"j({"effect": "mine", "formula": ")j" + formula +
                             R"j(", "parameters": {"k": {"start": 1}})j" + further + "}"));
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(FormulaEffect, SaysInWhichColumnAFormulaStumblesAndWhatIsAllowed) {
  EXPECT_EQ(refusal("k * tanh(v / 0.01)"), "");
  EXPECT_THAT(refusal("k * * v"),
              HasSubstr("own.json: /effects/0/formula \"k * * v\": column 5: '*'"));
  EXPECT_THAT(refusal("k * (v + 1"), HasSubstr("column 11: the end stands where ')' is expected"));
  EXPECT_THAT(refusal("k * velocity"),
              HasSubstr("column 5: 'velocity' is not known; this effect has a, k, u, v, x"));
  EXPECT_THAT(refusal("k * tan(v)"),
              HasSubstr("column 5: there is no function tan of 1 argument(s); allowed are"));
  EXPECT_THAT(refusal("tanh(v, u)"), HasSubstr("no function tanh of 2"));
  EXPECT_THAT(refusal("k v"), HasSubstr("column 3: 'v' stands where an operator"));
  EXPECT_THAT(refusal("k = v"), HasSubstr("column 3"));
  EXPECT_THAT(refusal("k / (1 - 1)"), HasSubstr("column 5: this divides by zero"));
  EXPECT_THAT(refusal("k * (2 * u)^12345678901234567890"),
              HasSubstr("column 5: the exponent is too large"));
  EXPECT_THAT(refusal("9^9^9^9 * v"), HasSubstr("not a finite number"));
  EXPECT_THAT(refusal("k * u + 0 ^ tanh(v)"),
              HasSubstr("formula \"k * u + 0 ^ tanh(v)\": column 9: this is a power of zero"));
  EXPECT_THAT(refusal(std::string(100, '(') + "v" + std::string(100, ')')),
              HasSubstr("nested too deep"));
  EXPECT_THAT(refusal(std::string(3000, '-') + "v"), HasSubstr("at most 2000"));
  EXPECT_THAT(refusal("k * z", R"j(, "states": {"z": {"rate": "v - q"}})j"),
              HasSubstr("rate of z \"v - q\": column 5: 'q'"));
  EXPECT_THAT(refusal("v", R"j(, "constants": {"u": 1})j"), HasSubstr("two meanings"));
  EXPECT_THAT(refusal("k * q", R"j(, "borrows": {"q": "gas_spring"})j"), HasSubstr("gas_spring"));
}

TEST(FormulaEffect, HasNoParameterInAUnitThatTheModelDoesNotCountIn) {
  const auto refusal_of = [](const std::string& unit) -> std::string {
    try {
      const Model model(parsed(R"j({"effect": "mine", "formula": "k * v",
        "parameters": {"k": {"start": 1, "unit": ")j" +
                               unit + R"j("}}})j"));
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  };
  for (const char* label : {"m", "m/s2", "s", "N", "K", "1/s", "m^-0.5"})
    EXPECT_EQ(refusal_of(label), "") << label;
  EXPECT_THAT(
      refusal_of("mm"),
      HasSubstr("/effects/0/parameters/k/unit: \"mm\" is a unit in which this model does not "
                "count, and the numbers of a formula are not converted: give start, bounds "
                "and prior in m"));
  EXPECT_THAT(refusal_of("g"), HasSubstr("prior in m/s^2"));
  EXPECT_THAT(refusal_of("degC"), HasSubstr("prior in K"));
}

TEST(FormulaEffect, SurvivesTheModelFilesRoundTrip) {
  const auto spec = parsed(R"j({"effect": "mine", "formula": "k * z",
    "states": {"z": {"rate": "v - z", "start": 0.5}}, "borrows": {"c": "viscous_damping"},
    "parameters": {"k": {"start": 2, "unit": "1/s^2"}}})j");
  const auto again = config::parse_model(config::to_json_text(spec), "again");
  ASSERT_TRUE(again);
  EXPECT_EQ(again->effects[0].formula, "k * z");
  EXPECT_EQ(again->effects[0].states.at("z").rate, "v - z");
  EXPECT_EQ(again->effects[0].states.at("z").start, 0.5);
  EXPECT_EQ(again->effects[0].borrows.at("c"), "viscous_damping");
  EXPECT_EQ(again->effects[0].parameters.at("k").unit, "1/s^2");
}

TEST(Model, RefusesABorrowerWithoutItsLenderAndAFormulaUnderACatalogueName) {
  EXPECT_THROW(Model(parsed(R"j({"effect": "pressure_friction"})j")), std::invalid_argument);
  try {
    const Model model(parsed(R"j({"effect": "laminar_orifice"}, {"effect": "gravity"})j"));
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("laminar_orifice is stated in terms of orifice_damping's theta1"));
  }
  try {
    const Model model(parsed(R"j({"effect": "gravity", "formula": "u"})j"));
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("the catalogue has an effect 'gravity'"));
  }
}

TEST(Model, FixesAParameterThatABorrowerLeavesWithoutInfluence) {
  const Model model(parsed(kOleo + R"j(, {"effect": "gas_heat_transfer"})j"));
  for (const ModelParameter& p : model.parameters())
    EXPECT_EQ(p.fixed, p.name == "theta4") << p.name;
}

}  // namespace
}  // namespace shaker::estimator
