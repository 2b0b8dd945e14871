// The test for changes inside the online estimator.
#include <functional>

#include <gtest/gtest.h>

#include "estimator/online_estimator.hpp"
#include "tests/estimator/online/cycles.hpp"

namespace shaker::estimator::online {
namespace {

using estimator::testing::kOleoSi;

constexpr double kNoise = 2e-5;
constexpr OnlineOptions kWatching{.false_alarms_per_cycle = 1e-4};

std::vector<ParameterChange> watched(
    long cycles, unsigned seed, const std::function<void(long, std::vector<double>&)>& change) {
  testing::Damper damper(estimator::testing::oleo(), kNoise, seed);
  OnlineEstimator online(testing::oleo_started({18.0, 1.4, 5.2, 1.08}), kWatching);
  std::vector<ParameterChange> seen;
  std::size_t events = 0;
  for (long i = 0; i < cycles; ++i) {
    std::vector<double> theta = kOleoSi;
    change(i, theta);
    const auto estimate = online.add(damper.cycle(0, i, theta));
    EXPECT_TRUE(estimate.ok());
    seen.insert(seen.end(), estimate->changes.begin(), estimate->changes.end());
    events += estimate->changes.empty() ? 0 : 1;  // those that look alike come together
    EXPECT_EQ(estimate->warnings.size(), events);
  }
  return seen;
}

TEST(OnlineChange, IsQuietWhileNothingChanges) {
  EXPECT_TRUE(watched(150, 1, [](long, std::vector<double>&) {}).empty());
}

TEST(OnlineChange, SaysWhichParameterJumpedWhenAndByHowMuch) {
  const auto seen = watched(60, 2, [](long i, std::vector<double>& theta) {
    if (i >= 40) theta[0] *= 0.97;
  });
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].name, "theta1");
  EXPECT_NEAR(static_cast<double>(seen[0].cycle), 40.0, 2.0);
  EXPECT_LT(seen[0].seen_at, 46);
  EXPECT_NEAR(seen[0].jump, -0.03 * kOleoSi[0], 5.0 * seen[0].standard_error);
  EXPECT_NE(seen[0].sentence().find("theta1 changed by -"), std::string::npos);
}

TEST(OnlineChange, SeesGasLeakSlowly) {
  const auto seen = watched(90, 3, [](long i, std::vector<double>& theta) {
    if (i >= 40) theta[1] *= 1.0 - 2e-4 * static_cast<double>(i - 40);
  });
  ASSERT_FALSE(seen.empty());
  EXPECT_EQ(seen[0].name, "theta2");
  EXPECT_LT(seen[0].jump, 0.0);
  EXPECT_GT(seen[0].seen_at, 40);
}

}  // namespace
}  // namespace shaker::estimator::online
