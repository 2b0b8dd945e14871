#include "estimator/diagnosis/internal/evaluation_budget.hpp"

#include <gtest/gtest.h>

namespace shaker::estimator::diagnosis {
namespace {

TEST(EvaluationBudget, LeavesAShareUntilTheRestIsSpent) {
  EvaluationBudget budget(1000.0);
  EXPECT_FALSE(budget.leaves_less_than(0.3));
  budget.spend(700, 1);
  EXPECT_FALSE(budget.leaves_less_than(0.3));
  EXPECT_TRUE(budget.leaves_less_than(0.4));
  budget.spend(1, 1);
  EXPECT_TRUE(budget.leaves_less_than(0.3));
  EXPECT_FALSE(budget.leaves_less_than(0.0));
}

TEST(EvaluationBudget, CountsSeveralCoordinatesForWhatTheyTake) {
  EvaluationBudget budget(1000.0);
  budget.spend(250, 2);
  EXPECT_FALSE(budget.leaves_less_than(0.0));
  budget.spend(1, 2);
  EXPECT_TRUE(budget.leaves_less_than(0.0));
}

TEST(EvaluationBudget, WithoutALimitNeverEnds) {
  EvaluationBudget budget;
  for (int i = 0; i < 1000; ++i)
    budget.spend(1 << 30, 3);
  EXPECT_FALSE(budget.leaves_less_than(0.99));
}

TEST(EvaluationBudget, EndsATaskThatHasTakenItsPart) {
  const auto budget = std::make_shared<EvaluationBudget>(1e6);
  EXPECT_TRUE(budget->spend_rates(1e3)) << "no task, no end";
  {
    const Task task(budget, 100.0);
    budget->spend(100, 1);
    EXPECT_FALSE(task.over());
    EXPECT_FALSE(budget->spend_rates(1.0));
    EXPECT_TRUE(task.over());
  }
  EXPECT_FALSE(budget->task_is_over());
  EXPECT_FALSE(budget->leaves_less_than(0.9));
}

TEST(EvaluationBudget, EndsAPartOfATaskWithThatTask) {
  const auto budget = std::make_shared<EvaluationBudget>();
  const Task whole(budget, 100.0);
  for (int fit = 0; fit < 2; ++fit) {
    const Task part(budget, 60.0);
    budget->spend(50, 1);
    EXPECT_FALSE(part.over()) << fit;
  }
  const Task part(budget, 60.0);
  budget->spend(1, 1);
  EXPECT_TRUE(part.over()) << "of the whole 101 are spent";
  const Task nobody_asks(nullptr, 0.0);
  EXPECT_FALSE(nobody_asks.over());
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
