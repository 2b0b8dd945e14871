// The change detection inside the online estimator.
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/online/change_watch.hpp"
#include "estimator/online/online_estimator.hpp"
#include "tests/estimator/online/cycles.hpp"

namespace shaker::estimator::online {
namespace {

using estimator::testing::kOleoSi;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

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
    events += estimate->changes.empty() ? 0 : 1;  // similar parameters come in one event
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
  EXPECT_TRUE(seen[0].alone);
  EXPECT_THAT(sentence(seen), HasSubstr("theta1 alone explains it"));
}

// The gas and the orifice change together.
TEST(OnlineChange, SaysThatNoParameterAloneExplainsAChangeOfTwo) {
  const auto seen = watched(60, 2, [](long i, std::vector<double>& theta) {
    if (i < 40) return;
    theta[0] *= 0.94;
    theta[1] *= 1.006;
  });
  ASSERT_FALSE(seen.empty());
  for (const ParameterChange& change : seen)
    EXPECT_FALSE(change.alone) << change.name;
  EXPECT_THAT(sentence(seen), HasSubstr("no parameter alone explains it (several changed"));
  EXPECT_THAT(sentence(seen), Not(HasSubstr("look alike")));
}

ParameterChange changed(const char* name, bool alone) {
  return {.name = name,
          .unit = "1/m",
          .run = 0,
          .cycle = 90,
          .jump = -0.5,
          .before = 10.0,
          .alone = alone};
}

TEST(ChangeSentence, SaysWhatAloneExplainsAChangeAndWhatDoesNot) {
  EXPECT_EQ(sentence({}), "");
  EXPECT_THAT(sentence({changed("a", true), changed("b", true), changed("c", true)}),
              EndsWith("; a alone explains it; so far this would look alike: b by -0.5 1/m, c by "
                       "-0.5 1/m"));
  EXPECT_THAT(sentence({changed("a", false)}),
              EndsWith("; no parameter alone explains it (several changed, the response has not "
                       "settled since, or the model lacks what changed)"));
  EXPECT_THAT(sentence({changed("a", false), changed("b", false)}),
              EndsWith("what changed); an alarm by themselves would be: b by -0.5 1/m"));
  EXPECT_THAT(sentence({changed("a", false), changed("b", false), changed("c", true)}),
              EndsWith("; a alone does not explain it, but this would: c by -0.5 1/m; an alarm by "
                       "themselves would be: b by -0.5 1/m"));
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
