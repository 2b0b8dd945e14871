#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "tests/estimator/diagnosis/two_decays.hpp"

namespace shaker::estimator::diagnosis {
namespace {

double dry(double v) {
  return std::tanh(v / 2e-3);
}

Result<Diagnosis> with_friction(const std::function<double(double, double)>& friction) {
  return testing::diagnosis_of_decays(
      [&](double u, double v) { return 40.0 * u + 0.4 * v + friction(u, v); });
}

TEST(PinchedFriction, IsNamedWhereFrictionIsLessAboutOneStroke) {
  const auto d = with_friction([](double u, double v) {
    const double apart = (u - 0.01) / 0.03;
    return 0.3 * (1.0 - std::exp(-apart * apart)) * dry(v);
  });
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "pinched_friction");
  EXPECT_GT(d->effects[0].probability, 0.9);
  ASSERT_GE(d->effects[0].parameters.size(), 3U);
  EXPECT_NEAR(d->effects[0].parameters[0].value, 0.3, 0.01);
  EXPECT_NEAR(d->effects[0].parameters[2].value, 0.03, 0.001);
  EXPECT_NEAR(d->effects[0].parameters[1].value, 0.01, 0.001);
}

TEST(PinchedFriction, IsNotNamedWhereFrictionIsTheSameAlongTheStroke) {
  const auto d = with_friction([](double, double v) { return 0.1 * dry(v); });
  ASSERT_TRUE(d) << d.error().what;
  ASSERT_FALSE(d->effects.empty());
  EXPECT_EQ(d->effects[0].name, "coulomb_friction");
  for (const auto& effect : d->effects)
    EXPECT_NE(effect.name, "pinched_friction");
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
