// What is scored, and what is not: no effect is passed by without a word.
#include "estimator/discrepancy/detect/scoring.hpp"

#include <cmath>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/discrepancy/diagnose.hpp"
#include "tests/estimator/discrepancy/free_decay.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::discrepancy {
namespace {

using ::testing::HasSubstr;

config::ModelSpec oscillator(double k) {
  auto model = estimator::testing::linear_oscillator();
  model.effects[0].parameters["c"].start = 0.2;
  model.effects[1].parameters["k"].start = k;
  return model;
}

// A model without an orifice may lack its drag.
TEST(Scoring, NamesTheDragOfAModelThatHasNone) {
  Campaign campaign;
  campaign.runs.push_back(testing::decay_of(
      [](double u, double v) { return 40.0 * u + 0.1 * v + 1.5 * std::fabs(v) * v; }, {}));
  const auto d = diagnose(campaign, oscillator(42.0));
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "orifice_damping");
  EXPECT_GT(d->effects[0].probability, 0.9);
  EXPECT_NEAR(d->effects[0].parameters.at(0).value, 1.5, 0.05);
}

// A pendulum in air, in radians: its sine is in the model's file.
TEST(Scoring, NamesTheDragOfAPendulum) {
  Campaign campaign;
  campaign.runs.push_back(testing::decay_of(
      [](double u, double v) { return 20.0 * std::sin(u) + 0.02 * v + 0.01 * std::fabs(v) * v; },
      {.start = 1.0, .duration = 25.0, .rate = 100.0, .noise = 2e-4}));
  auto model = estimator::testing::linear_oscillator();
  model.length_unit = "rad";
  model.effects[0].parameters["c"].start = 0.02;
  auto& weight = model.effects[1];
  weight = {};
  weight.effect = "weight";
  weight.formula = "k * sin(u)";
  weight.parameters["k"].start = 19.0;
  weight.parameters["k"].lower = 0.0;
  weight.parameters["k"].upper = 1e3;
  weight.parameters["k"].unit = "1/s^2";
  const auto d = diagnose(campaign, model);
  ASSERT_TRUE(d) << d.error().what;
  ASSERT_FALSE(d->effects.empty());
  EXPECT_EQ(d->effects[0].name, "orifice_damping");
  EXPECT_GT(d->effects[0].probability, 0.9);
}

}  // namespace
}  // namespace shaker::estimator::discrepancy
