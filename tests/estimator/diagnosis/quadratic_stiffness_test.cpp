#include <cstdint>
#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "tests/estimator/diagnosis/free_decay.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

Result<Diagnosis> of_decays(const std::function<double(double, double)>& force) {
  Campaign campaign;
  campaign.name = "decays";
  std::uint64_t seed = 1;
  for (const double start : {0.1, -0.08}) {
    campaign.runs.push_back(testing::decay_of(force, {start, 8.0, 100.0, 2e-5, seed++}));
    campaign.runs.back().name = "r" + std::to_string(seed);
  }
  return diagnose(campaign, estimator::testing::linear_oscillator());
}

TEST(QuadraticStiffness, IsNamedWhereASpringStiffensToOneSide) {
  const auto d = of_decays([](double u, double v) { return 40.0 * u + 0.4 * v + 60.0 * u * u; });
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
  const auto d =
      of_decays([](double u, double v) { return 40.0 * u + 0.4 * v + 800.0 * u * u * u; });
  ASSERT_TRUE(d) << d.error().what;
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "cubic_stiffness");
}

TEST(QuadraticStiffness, IsNotNamedWhereNothingIsMissing) {
  const auto d = of_decays([](double u, double v) { return 40.0 * u + 0.4 * v; });
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::adequate);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
