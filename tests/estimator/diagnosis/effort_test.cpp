#include "estimator/diagnosis/effort.hpp"

#include <gtest/gtest.h>

namespace shaker::estimator::diagnosis {
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

TEST(Effort, EndsATaskThatHasTakenItsPart) {
  const auto effort = std::make_shared<Effort>(1e6);
  EXPECT_TRUE(effort->spend_rates(1e3)) << "no task, no end";
  {
    const Task task(effort, 100.0);
    effort->spend(100, 1);
    EXPECT_FALSE(task.over());
    EXPECT_FALSE(effort->spend_rates(1.0));
    EXPECT_TRUE(task.over());
  }
  EXPECT_FALSE(effort->task_is_over());
  EXPECT_FALSE(effort->leaves_less_than(0.9));
}

TEST(Effort, EndsAPartOfATaskWithThatTask) {
  const auto effort = std::make_shared<Effort>();
  const Task whole(effort, 100.0);
  for (int fit = 0; fit < 2; ++fit) {
    const Task part(effort, 60.0);
    effort->spend(50, 1);
    EXPECT_FALSE(part.over()) << fit;
  }
  const Task part(effort, 60.0);
  effort->spend(1, 1);
  EXPECT_TRUE(part.over()) << "of the whole 101 are spent";
  const Task nobody_asks(nullptr, 0.0);
  EXPECT_FALSE(nobody_asks.over());
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
