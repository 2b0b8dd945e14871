#include <gtest/gtest.h>

#include "tests/estimator/diagnosis/two_decays.hpp"

namespace shaker::estimator::diagnosis {
namespace {

TEST(StrokeDamping, IsNamedWhereAMagnetComesNearer) {
  const auto d = testing::diagnosis_of_decays(
      [](double u, double v) { return 40.0 * u + (0.4 + 5.0 * u) * v; });
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "stroke_damping");
  EXPECT_GT(d->effects[0].probability, 0.9);
  ASSERT_FALSE(d->effects[0].parameters.empty());
  EXPECT_NEAR(d->effects[0].parameters[0].value, 5.0,
              4.0 * d->effects[0].parameters[0].standard_error);
}

TEST(StrokeDamping, IsNotNamedWhereAValveDampsOneWay) {
  const auto d = testing::diagnosis_of_decays(
      [](double u, double v) { return 40.0 * u + (v > 0.0 ? 0.3 : 0.6) * v; });
  ASSERT_TRUE(d) << d.error().what;
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "one_sided_damping");
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
