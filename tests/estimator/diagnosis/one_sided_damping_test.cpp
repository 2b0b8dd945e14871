// Damping of one direction: where it is the truth, and where not.
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

TEST(OneSidedDamping, IsNamed) {
  const auto d = testing::diagnosis_of_decays(
      [](double u, double v) { return 80.0 * u + 0.9 * v - 0.5 * std::fmax(v, 0.0); });
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_THAT(names_in(*d), ::testing::ElementsAre("one_sided_damping"));
  EXPECT_NEAR(value_in(*d, "c_1"), -0.5, 0.01);
}

TEST(OneSidedDamping, IsNotNamedWhereThereIsNone) {
  const auto d =
      testing::diagnosis_of_decays([](double u, double v) { return 80.0 * u + 0.9 * v; });
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::adequate);
}

TEST(OneSidedDamping, IsNotNamedInPlaceOfDryFriction) {
  const auto d = testing::diagnosis_of_decays(
      [](double u, double v) { return 80.0 * u + 0.6 * v + 0.2 * std::tanh(v / 2e-3); });
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_THAT(names_in(*d), ::testing::ElementsAre(::testing::EndsWith("_friction")));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
