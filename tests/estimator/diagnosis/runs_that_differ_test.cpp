// Runs whose charge or damping differ from each other lack no effect.
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "tests/estimator/diagnosis/campaigns.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

constexpr double kTheta2 = 1.48077;  // m/s^2, of the virtual oleo
// Of a run: its charge over that of all. By up to forty times what the cycles are known to.
const std::vector<double> kCharges = {1.012, 0.991, 1.017, 0.984, 1.003, 0.993};

Campaign with_charges(const std::vector<double>& charges,
                      const std::map<std::string, double>& truth) {
  Campaign all;
  for (std::size_t i = 0; i < charges.size(); ++i) {
    auto own = truth;
    own["theta2"] = kTheta2 * charges[i];
    Campaign one = testing::recorded(own, {testing::kSixRuns[i]}, 11 + i);
    one.runs[0].name = "r" + std::to_string(i + 1);
    all.runs.push_back(std::move(one.runs[0]));
  }
  all.name = "charges";
  return all;
}

TEST(RunsThatDiffer, LackNoEffectHoweverMuchTheirChargesMoveTheResponse) {
  const auto d = diagnose(with_charges(kCharges, {}), estimator::testing::oleo());
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::adequate);
  EXPECT_THAT(d->warnings, Contains(HasSubstr("nothing else is missing, but the runs differ")));
  EXPECT_THAT(d->warnings, Contains(HasSubstr("the gas pressure, by 1.")));
}

TEST(RunsThatDiffer, DoNotHideAnEffect) {
  const auto d =
      diagnose(with_charges({1.002, 0.999, 1.001, 0.998, 1.0, 1.001}, {{"coulomb_friction", 0.3}}),
               estimator::testing::oleo());
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_NE(d->verdict, Verdict::adequate);
  ASSERT_FALSE(d->effects.empty());
  EXPECT_THAT(d->effects[0].name, HasSubstr("friction"));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
