// Damping of one direction, and damping that gives way: where they are the truth, and where not.
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "two_decays.hpp"

namespace shaker::estimator::diagnosis {
namespace {

std::vector<std::string> names_in(const Diagnosis& d) {
  std::vector<std::string> names;
  for (const NamedEffect& effect : d.effects)
    names.push_back(effect.name);
  return names;
}

double value_in(const Diagnosis& d, const std::string& symbol) {
  for (const ParameterEstimate& p : d.effects.at(0).parameters)
    if (p.name == symbol) return p.value;
  return std::nan("");
}

TEST(DampingOfValves, OfOneDirectionIsNamed) {
  const auto d = testing::diagnosis_of_decays(
      [](double u, double v) { return 80.0 * u + 0.9 * v - 0.5 * std::fmax(v, 0.0); });
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_THAT(names_in(*d), ::testing::ElementsAre("one_sided_damping"));
  EXPECT_NEAR(value_in(*d, "c_1"), -0.5, 0.01);
}

TEST(DampingOfValves, ThatGivesWayIsNamed) {
  const auto d = testing::diagnosis_of_decays([](double u, double v) {
    return 80.0 * u + 0.2 * v + 1.2 * v / std::sqrt(1.0 + std::pow(v / 0.5, 2));
  });
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_THAT(names_in(*d), ::testing::ElementsAre("digressive_damping"));
  EXPECT_NEAR(value_in(*d, "c_d"), 1.2, 0.05);
  EXPECT_NEAR(value_in(*d, "v_k"), 0.5, 0.03);
}

TEST(DampingOfValves, OfAPowerOfTheVelocityIsNamed) {
  const auto d = testing::diagnosis_of_decays([](double u, double v) {
    return 80.0 * u + 0.3 * v + 0.5 * std::copysign(std::pow(std::fabs(v), 0.7), v);
  });
  ASSERT_TRUE(d) << d.error().what;
  ASSERT_THAT(names_in(*d), ::testing::ElementsAre("power_damping"));
  EXPECT_NEAR(value_in(*d, "alpha"), 0.7, 0.03);
}

TEST(DampingOfValves, IsNotNamedWhereThereIsNone) {
  const auto d =
      testing::diagnosis_of_decays([](double u, double v) { return 80.0 * u + 0.9 * v; });
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::adequate);
}

TEST(DampingOfValves, IsNotNamedInPlaceOfDryFriction) {
  const auto d = testing::diagnosis_of_decays(
      [](double u, double v) { return 80.0 * u + 0.6 * v + 0.2 * std::tanh(v / 2e-3); });
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_THAT(names_in(*d), ::testing::ElementsAre(::testing::EndsWith("_friction")));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
