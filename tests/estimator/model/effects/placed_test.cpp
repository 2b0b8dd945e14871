// A place of rest that the model file states among the parameters.
#include "estimator/model/effects/placed.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <string>

#include <gtest/gtest.h>

#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/model.hpp"
#include "estimator/model/model_arrays.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

constexpr int kPointsOfMotion = 100;  // more than one block

ModelArrays along_a_motion(const Model& model, const std::vector<double>& theta) {
  ModelArrays arrays;
  arrays.shape(model, kPointsOfMotion);
  for (std::size_t i = 0; i < kPointsOfMotion; ++i) {
    arrays.u[0][i] = 0.1 + 0.04 * std::sin(0.1 * static_cast<double>(i));
    arrays.v[0][i] = 0.3 * std::cos(0.1 * static_cast<double>(i));
  }
  EXPECT_TRUE(arrays.evaluate(model, kPointsOfMotion, theta.data()));
  return arrays;
}

class PlacedEffect : public ::testing::TestWithParam<const char*> {};

TEST_P(PlacedEffect, ActsAsWithTheSameConstantAndHasTheSlopeOfItsPlace) {
  constexpr double kWhere = 0.07, kOfPlace = 1e-6, kSizeOfForce = 3.0;
  config::EffectSpec stated = testing::effect(GetParam()), free = stated;
  stated.constants["u0"] = kWhere;
  free.parameters["u0"].start = kWhere;
  const Model fixed(testing::model_of({stated})), fitted(testing::model_of({free}));
  ASSERT_EQ(fitted.parameter_count(), 2);
  EXPECT_EQ(fitted.parameters()[1].symbol, "u0");
  EXPECT_EQ(fitted.parameters()[1].unit, "m");
  EXPECT_EQ(fitted.parameters()[1].start, kWhere);
  const ModelArrays a = along_a_motion(fixed, {kSizeOfForce}),
                    b = along_a_motion(fitted, {kSizeOfForce, kWhere});
  const ModelArrays more = along_a_motion(fitted, {kSizeOfForce, kWhere + kOfPlace}),
                    less = along_a_motion(fitted, {kSizeOfForce, kWhere - kOfPlace});
  for (std::size_t i = 0; i < kPointsOfMotion; ++i) {
    EXPECT_DOUBLE_EQ(b.g[0][i], a.g[0][i]);
    EXPECT_DOUBLE_EQ(b.g_u[0][i], a.g_u[0][i]);
    EXPECT_DOUBLE_EQ(b.g_v[0][i], a.g_v[0][i]);
    EXPECT_DOUBLE_EQ(b.g_theta[0][i], a.g_theta[0][i]);
    EXPECT_NEAR(b.g_theta[1][i], (more.g[0][i] - less.g[0][i]) / (2.0 * kOfPlace),
                1e-6 * (1.0 + std::fabs(b.g_theta[1][i])));
  }
}

INSTANTIATE_TEST_SUITE_P(Catalogue, PlacedEffect,
                         ::testing::Values("linear_stiffness", "quadratic_stiffness",
                                           "cubic_stiffness", "quintic_stiffness",
                                           "stroke_damping"));

TEST(Placed, IsEachEffectOfTheCatalogueThatHasAPlaceAndNothingElse) {
  int count = 0;
  for (const Effect* effect : catalogue())
    count += has_place(*effect) ? 1 : 0;
  EXPECT_EQ(count, 5);
  EXPECT_FALSE(has_place(*find_effect("coulomb_friction")));
}

TEST(Placed, StatedTwiceIsRefused) {
  config::EffectSpec twice = testing::effect("cubic_stiffness");
  twice.constants["u0"] = 0.1;
  twice.parameters["u0"].start = 0.1;
  EXPECT_THROW(Model(testing::model_of({twice})), std::invalid_argument);
}

}  // namespace
}  // namespace shaker::estimator
