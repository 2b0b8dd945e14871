#include "estimator/discrepancy/effort.hpp"

#include <gtest/gtest.h>

namespace shaker::estimator::discrepancy {
namespace {

TEST(Effort, LeavesAShareUntilTheRestIsSpent) {
  Effort effort(1000.0);
  EXPECT_FALSE(effort.leaves_less_than(0.3));
  effort.spend(700, 1);
  EXPECT_FALSE(effort.leaves_less_than(0.3));
  EXPECT_TRUE(effort.leaves_less_than(0.4));
  effort.spend(1, 1);
  EXPECT_TRUE(effort.leaves_less_than(0.3));
  EXPECT_FALSE(effort.leaves_less_than(0.0));
}

TEST(Effort, CountsSeveralCoordinatesForWhatTheyTake) {
  Effort effort(1000.0);
  effort.spend(250, 2);
  EXPECT_FALSE(effort.leaves_less_than(0.0));
  effort.spend(1, 2);
  EXPECT_TRUE(effort.leaves_less_than(0.0));
}

TEST(Effort, WithoutALimitNeverEnds) {
  Effort effort;
  for (int i = 0; i < 1000; ++i)
    effort.spend(1 << 30, 3);
  EXPECT_FALSE(effort.leaves_less_than(0.99));
}

}  // namespace
}  // namespace shaker::estimator::discrepancy
