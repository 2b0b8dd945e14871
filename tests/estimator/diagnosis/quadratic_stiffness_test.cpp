#include <gtest/gtest.h>

#include "tests/estimator/diagnosis/two_decays.hpp"

namespace shaker::estimator::diagnosis {
namespace {

TEST(QuadraticStiffness, IsNamedWhereASpringStiffensToOneSide) {
  const auto d = testing::diagnosis_of_decays(
      [](double u, double v) { return 40.0 * u + 0.4 * v + 60.0 * u * u; });
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "quadratic_stiffness");
  EXPECT_GT(d->effects[0].probability, 0.9);
  ASSERT_FALSE(d->effects[0].parameters.empty());
  EXPECT_NEAR(d->effects[0].parameters[0].value, 60.0,
              4.0 * d->effects[0].parameters[0].standard_error);
}

TEST(QuadraticStiffness, IsNotNamedWhereASpringStiffensToBothSides) {
  const auto d = testing::diagnosis_of_decays(
      [](double u, double v) { return 40.0 * u + 0.4 * v + 800.0 * u * u * u; });
  ASSERT_TRUE(d) << d.error().what;
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "cubic_stiffness");
}

TEST(QuadraticStiffness, IsNotNamedWhereNothingIsMissing) {
  const auto d =
      testing::diagnosis_of_decays([](double u, double v) { return 40.0 * u + 0.4 * v; });
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::adequate);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
