// What a diagnosis spends, so that it ends in a given time: counted in points of periodic solutions
// that are linearised, and not in seconds. A campaign goes the same way however slow the machine is
// and whatever else runs there.
#pragma once

#include <limits>

namespace shaker::estimator::discrepancy {

// Of one diagnosis; its runs share it. One thread.
class Effort {
 public:
  explicit Effort(double limit = std::numeric_limits<double>::infinity()) : limit_(limit) {}

  // Several coordinates are solved by a banded factorisation with row exchanges: measured, two take
  // four times as long as one.
  void spend(int points, int coordinates) {
    spent_ += static_cast<double>(points) * (coordinates == 1 ? 1.0 : 2.0 * coordinates);
  }
  // So much of the limit is left to those who come later.
  bool leaves_less_than(double share) const { return spent_ > (1.0 - share) * limit_; }

 private:
  double limit_;
  double spent_ = 0.0;
};

}  // namespace shaker::estimator::discrepancy
