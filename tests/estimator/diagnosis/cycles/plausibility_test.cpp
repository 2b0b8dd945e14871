#include "estimator/diagnosis/cycles/internal/plausibility.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/estimator/diagnosis/campaigns.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using ::testing::HasSubstr;

// Two runs of the virtual rig with every displacement multiplied by `factor`.
std::vector<SteadyRun> runs_times(double factor) {
  Campaign campaign = testing::recorded({}, {{2.0, 2.0}, {3.0, 3.0}}, 3);
  std::vector<SteadyRun> runs;
  for (Recording& recording : campaign.runs) {
    for (double& u : recording.displacement)
      u *= factor;
    runs.push_back(steady_cycles(recording).value());
  }
  return runs;
}

TEST(Plausibility, HasNothingToSayOfARigAsItShouldBe) {
  std::vector<std::string> warnings;
  EXPECT_TRUE(plausible(runs_times(1.0), estimator::testing::oleo(), warnings));
  EXPECT_TRUE(plausible(runs_times(3.0), estimator::testing::oleo(), warnings));
  EXPECT_TRUE(warnings.empty());
}

TEST(Plausibility, RefusesMillimetresThatAreCalledMetresAndTheReverse) {
  std::vector<std::string> warnings;
  for (const double factor : {1e3, 1e-3}) {
    const auto said = plausible(runs_times(factor), estimator::testing::oleo(), warnings);
    ASSERT_FALSE(said) << factor;
    EXPECT_EQ(said.error().kind, ErrorKind::invalid);
    EXPECT_THAT(said.error().what, HasSubstr("is /units/displacement what the files count in?"));
  }
}

TEST(Plausibility, RefusesASensorWhoseSignIsTurned) {
  std::vector<std::string> warnings;
  const auto said = plausible(runs_times(-1.0), estimator::testing::oleo(), warnings);
  ASSERT_FALSE(said);
  EXPECT_THAT(said.error().what, HasSubstr("turn the sensor's sign"));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
