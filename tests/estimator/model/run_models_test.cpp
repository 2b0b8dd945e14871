#include "estimator/model/run_models.hpp"

#include <cmath>

#include <gmock/gmock.h>

#include "estimator/solve/periodic/periodic_system.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::vector<config::RunCondition> kRuns = {{"r01", "cold", {{"gas_temperature", 250.0}}},
                                                 {"r02", "warm", {{"gas_temperature", 300.0}}},
                                                 {"r03", "warm", {{"gas_temperature", 350.0}}}};

void vary(config::ModelSpec& spec, std::size_t effect, const std::string& name,
          config::RunVariation variation) {
  spec.effects[effect].parameters[name].variation = std::move(variation);
}

std::vector<std::string> names_of(const Model& model) {
  std::vector<std::string> names;
  for (const ModelParameter& p : model.parameters())
    names.push_back(p.name);
  return names;
}

TEST(RunModels, NameTheValuesByRunAndGroup) {
  auto spec = testing::oleo();
  vary(spec, 0, "theta1", {"run", "", {}});
  vary(spec, 1, "theta2", {"group", "", {}});
  vary(spec, 1, "theta3", {"", "1/gas_temperature", 280.0});
  const auto models = run_models(spec, kRuns);
  ASSERT_TRUE(models) << models.error().what;
  EXPECT_THAT(names_of(models->joint()),
              ElementsAre("theta1[r01]", "theta1[r02]", "theta1[r03]", "theta2[cold]",
                          "theta2[warm]", "theta3", "theta4"));
  ASSERT_EQ(models->varying[2].size(), 3U);
  EXPECT_EQ(models->varying[2][0].index, 2);
  EXPECT_EQ(models->varying[2][1].index, 4);
  EXPECT_NEAR(models->varying[2][2].factor, 280.0 / 350.0, 1e-15);
}

// Each run answers as the model of the file does with that run's values, and its sensitivities are
// those of that model. The effects take all ways through the evaluation: lenders and borrowers,
// memory, exciter, instrument.
void expect_own_values(config::ModelSpec spec) {
  for (auto& effect : spec.effects) {
    for (auto& [name, parameter] : effect.parameters)
      parameter.variation = {"run", "", {}};
  }
  vary(spec, 1, "theta2", {"", "gas_temperature", {}});
  const Model single(spec);
  const auto models = run_models(spec, kRuns);
  ASSERT_TRUE(models) << models.error().what;
  std::vector<double> joint = models->joint().start();
  for (std::size_t k = 0; k < joint.size(); ++k)
    joint[k] *= 1.0 + 0.01 * static_cast<double>(k % 5);
  for (std::size_t r = 0; r < kRuns.size(); ++r) {
    std::vector<double> own;
    std::vector<RunParameter> from;
    for (const ModelParameter& p : single.parameters()) {
      RunParameter place = {p.name, -1, 1.0};
      for (const RunParameter& varying : models->varying[r]) {
        if (varying.name == p.name) place = varying;
      }
      for (int k = 0; place.index < 0 && k < models->joint().parameter_count(); ++k) {
        if (models->joint().parameters()[static_cast<std::size_t>(k)].name == p.name)
          place.index = k;
      }
      own.push_back(place.factor * joint[static_cast<std::size_t>(place.index)]);
      from.push_back(place);
    }
    const GridOptions grid = {Scheme::order6, 160, true};
    PeriodicSystem whole(*models->of_run[r], grid), alone(single, grid);
    whole.set_excitation(1.5, 2.0);
    alone.set_excitation(1.5, 2.0);
    ASSERT_EQ(whole.solve_from_rest(joint).status, SolveStatus::converged);
    ASSERT_EQ(alone.solve_from_rest(own).status, SolveStatus::converged);
    for (const int i : {0, 17, 80, 131}) {
      EXPECT_NEAR(whole.observed(i), alone.observed(i), 1e-11);
      std::vector<double> expected(joint.size(), 0.0);
      for (std::size_t k = 0; k < own.size(); ++k)
        expected[static_cast<std::size_t>(from[k].index)] +=
            from[k].factor * alone.observed_row(i)[1 + k];
      for (std::size_t k = 0; k < joint.size(); ++k)
        EXPECT_NEAR(whole.observed_row(i)[1 + k], expected[k],
                    1e-8 * std::fabs(expected[k]) + 1e-11)
            << names_of(models->joint())[k] << " at " << i;
    }
  }
}

TEST(RunModels, GiveEachRunItsOwnValuesWithOneCoordinate) {
  auto spec = testing::oleo();
  spec.effects.push_back(testing::effect("metering_pin"));
  spec.effects[0].parameters["theta1"].start = 13.3;
  spec.effects[1].parameters["theta3"].start = 4.3;
  spec.effects[3].parameters["k1"].start = 0.1;
  expect_own_values(spec);
}

TEST(RunModels, GiveEachRunItsOwnValuesWithMemoryExciterAndInstrument) {
  auto spec = testing::oleo();
  for (const char* name : {"presliding_friction", "exciter_gain", "sensor_gain", "sensor_lag"})
    spec.effects.push_back(testing::effect(name));
  spec.effects[0].parameters["theta1"].start = 13.3;
  spec.effects[1].parameters["theta3"].start = 4.3;
  for (std::size_t e = 3; e < spec.effects.size(); ++e) {
    const Model known(testing::model_of({testing::effect("orifice_damping"), spec.effects[e]}));
    for (const ModelParameter& p : known.parameters()) {
      if (p.effect == spec.effects[e].effect) spec.effects[e].parameters[p.name] = {};
    }
  }
  expect_own_values(spec);
}

// Friction beside the same friction in proportion to a current, which is off in one run.
TEST(RunModels, GiveAnEffectThatAnInputDrivesTheInputOfTheRun) {
  auto spec = testing::model_of({testing::effect("coulomb_friction"),
                                 testing::effect("coulomb_friction over current"),
                                 testing::effect("linear_stiffness")});
  spec.effects[1].reference = 2.0;
  const std::vector<config::RunCondition> runs = {{"off", "", {{"current", 0.0}}},
                                                  {"half", "", {{"current", 1.0}}},
                                                  {"full", "", {{"current", 2.0}}}};
  EXPECT_TRUE(varies_by_run(spec));
  EXPECT_THAT(taken_as_one(spec, "a plan"), HasSubstr("coulomb_friction over current"));
  const auto models = run_models(spec, runs);
  ASSERT_TRUE(models) << models.error().what;
  EXPECT_THAT(names_of(models->joint()), ElementsAre("f_c", "f_c[current]", "k"));
  EXPECT_EQ(models->joint().parameters()[1].effect, "coulomb_friction over current");
  EXPECT_EQ(models->joint().parameters()[1].line, 1U);
  EXPECT_EQ(models->joint().parameters()[1].symbol, "f_c");
  for (std::size_t r = 0; r < runs.size(); ++r) {
    ASSERT_EQ(models->varying[r].size(), 1U);
    EXPECT_EQ(models->varying[r][0].name, "f_c[current]");
    EXPECT_DOUBLE_EQ(models->varying[r][0].factor, 0.5 * static_cast<double>(r));
  }
  spec.effects[1].reference.reset();  // the mean of runs that are partly off: a share of nothing
  EXPECT_THAT(run_models(spec, runs).error().what, HasSubstr("0 is possible beside"));
  spec.effects[1].reference = 2.0;
  auto backwards = runs;
  backwards[0].values["current"] = -1.0;
  EXPECT_FALSE(run_models(spec, backwards));
}

TEST(RunModels, RefuseAnInputOfAnEffectWithoutACoefficient) {
  auto spec = testing::oleo();
  spec.effects[1].effect = "gas_spring over current";
  try {
    const Model refused(spec);
    FAIL() << "the gas has no coefficient";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("gas_spring has no coefficient"));
  }
}

TEST(RunModels, SayWhichRunLacksWhat) {
  auto spec = testing::oleo();
  vary(spec, 1, "theta2", {"group", "", {}});
  auto runs = kRuns;
  runs[1].group.clear();
  EXPECT_THAT(run_models(spec, runs).error().what, HasSubstr("run r02 has no \"group\""));
  vary(spec, 1, "theta2", {"", "charge", {}});
  EXPECT_THAT(run_models(spec, runs).error().what, HasSubstr("run r01 does not say its charge"));
  for (auto& run : runs)
    run.values["charge"] = 0.0;
  EXPECT_THAT(run_models(spec, runs).error().what, HasSubstr("must be above 0"));
  EXPECT_THAT(taken_as_one(spec, "a plan"), HasSubstr("theta2"));
  EXPECT_EQ(taken_as_one(testing::oleo(), "a plan"), "");
}

}  // namespace
}  // namespace shaker::estimator
