// The evaluation budget of a diagnosis. It counts linearised points of periodic solutions and of
// integrated records, and not seconds. Therefore the answer does not depend on the speed or the
// load of the machine.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>

namespace shaker::estimator::diagnosis {

// The budget of one diagnosis, shared by its runs. Use it from one thread.
class EvaluationBudget {
 public:
  explicit EvaluationBudget(double limit = std::numeric_limits<double>::infinity())
      : limit_(limit) {}

  // Several coordinates need a banded factorisation with row exchanges. Measured: two coordinates
  // take four times as long as one.
  void spend(int points, int coordinates) {
    spent_ += static_cast<double>(points) * (coordinates == 1 ? 1.0 : 2.0 * coordinates);
  }
  // Counts an integration. `numbers`: how many rates of states and sensitivities it has computed.
  // Returns false when the present task has used its share.
  bool spend_rates(double numbers) {
    spent_ += kPointsPerRate * numbers;
    return !task_is_over();
  }
  // True if less than `share` of the limit is left.
  bool leaves_less_than(double share) const { return spent_ > (1.0 - share) * limit_; }
  bool task_is_over() const { return spent_ > task_ends_; }

 private:
  friend class Task;
  static constexpr double kPointsPerRate = 0.03;  // measured

  double limit_;
  double spent_ = 0.0;
  double task_ends_ = std::numeric_limits<double>::infinity();
};

// Limits a part of the work to `most` points, and to what the enclosing task has left. The limit
// holds while the object lives.
class Task {
 public:
  // `budget` may be null: then there is no limit.
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

  // True when the limit is reached. The result at that moment need not be right.
  bool over() const { return budget_ && budget_->task_is_over(); }

 private:
  std::shared_ptr<EvaluationBudget> budget_;
  double before_ = 0.0;
};

}  // namespace shaker::estimator::diagnosis
