// The bias of second order (worth/second_order.hpp) from cycle to cycle: off the published estimate
// where it matters, as `shakerctl estimate` has it, and looked at only where it may.
//
// In standard errors it grows as they do. Once it is far below the share from which on it is taken
// off, it stays there while they shrink, as they do with every cycle, and the parameters stay
// within them; a look costs 2 q solutions of all runs for q parameters.
#pragma once

#include <vector>

#include "estimator/estimation.hpp"

namespace shaker::estimator::online {

class BiasWatch {
 public:
  // `estimate` describes the last fit of `estimator`, which stays. False where looking about may
  // have led off its branch of periodic solutions: the next fit must not be a warm one.
  bool take_off(Estimate& estimate, Estimator& estimator, const Model& model);
  // The runs are others than before: what was seen of them says nothing now.
  void reset() { seen_.clear(); }
  int looks() const { return looks_; }  // taken so far

 private:
  int looks_ = 0;
  double largest_ = 0.0;      // bias, when it was last looked at
  std::vector<double> seen_;  // standard errors then; empty: look
  std::vector<double> at_;    // theta then
};

}  // namespace shaker::estimator::online
