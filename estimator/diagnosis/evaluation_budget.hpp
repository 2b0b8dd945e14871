// What a diagnosis spends, so that it ends in a given time: counted in points that are linearised, of
// periodic solutions and of integrated records, and not in seconds. A campaign goes the same way
// however slow the machine is and whatever else runs there.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>

namespace shaker::estimator::diagnosis {

// Of one diagnosis; its runs share it. One thread.
class EvaluationBudget {
 public:
  explicit EvaluationBudget(double limit = std::numeric_limits<double>::infinity())
      : limit_(limit) {}

  // Several coordinates are solved by a banded factorisation with row exchanges: measured, two take
  // four times as long as one.
  void spend(int points, int coordinates) {
    spent_ += static_cast<double>(points) * (coordinates == 1 ? 1.0 : 2.0 * coordinates);
  }
  // Of an integration: states and sensitivities whose rates were computed. False: the task at hand
  // has taken all that it may.
  bool spend_rates(double numbers) {
    spent_ += kPointsPerRate * numbers;
    return !task_is_over();
  }
  // So much of the limit is left to those who come later.
  bool leaves_less_than(double share) const { return spent_ > (1.0 - share) * limit_; }
  bool task_is_over() const { return spent_ > task_ends_; }

 private:
  friend class Task;
  static constexpr double kPointsPerRate = 0.03;  // measured

  double limit_;
  double spent_ = 0.0;
  double task_ends_ = std::numeric_limits<double>::infinity();
};

// A piece of the work that may take so much at most, and no more than is left of the task that it
// is part of. While it lives, what is spent is its own.
class Task {
 public:
  // `effort`: null: nobody asks.
  Task(std::shared_ptr<EvaluationBudget> budget, double most) : budget_(std::move(budget)) {
    if (!budget_) return;
    before_ = budget_->task_ends_;
    budget_->task_ends_ = std::min(before_, budget_->spent_ + most);
  }
  ~Task() {
    if (budget_) budget_->task_ends_ = before_;
  }
  Task(const Task&) = delete;
  Task& operator=(const Task&) = delete;

  // What it has found by then is not known to be right.
  bool over() const { return budget_ && budget_->task_is_over(); }

 private:
  std::shared_ptr<EvaluationBudget> budget_;
  double before_ = 0.0;
};

}  // namespace shaker::estimator::diagnosis
