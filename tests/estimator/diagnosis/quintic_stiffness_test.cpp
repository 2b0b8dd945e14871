#include <cmath>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "tests/estimator/diagnosis/two_decays.hpp"

namespace shaker::estimator::diagnosis {
namespace {

TEST(QuinticStiffness, IsNamedWhereASpringStiffensFarFromItsCentre) {
  const auto d = testing::diagnosis_of_decays(
      [](double u, double v) { return 40.0 * u + 0.4 * v + 2e5 * std::pow(u, 5); });
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "quintic_stiffness");
  EXPECT_GT(d->effects[0].probability, 0.9);
  ASSERT_FALSE(d->effects[0].parameters.empty());
  EXPECT_NEAR(d->effects[0].parameters[0].value, 2e5,
              4.0 * d->effects[0].parameters[0].standard_error);
}

// sin(u) is no cube at 1.5 rad. A catalogue without a fifth power finds hysteresis in the rest.
TEST(QuinticStiffness, LetsTheDragOfAWidePendulumBeNamed) {
  const auto d = testing::diagnosis_of_decays(
      [](double u, double v) { return 25.0 * std::sin(u) + 0.05 * v + 0.05 * std::abs(v) * v; },
      {1.5});
  ASSERT_TRUE(d) << d.error().what;
  std::set<std::string> named;
  for (const auto& effect : d->effects)
    named.insert(effect.name);
  for (const auto& e : d->effects)
    printf("%s %g\n", e.name.c_str(), e.probability);
  EXPECT_TRUE(named.contains("orifice_damping"));
  EXPECT_TRUE(named.contains("cubic_stiffness"));
  EXPECT_FALSE(named.contains("bouc_wen_hysteresis"));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
