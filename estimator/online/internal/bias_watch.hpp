// Corrects the published estimates for second-order bias (inference/second_order.hpp), where it is
// large enough, as `shakerctl estimate` does. It computes the bias only when needed.
//
// In units of the standard errors, the bias is proportional to them. If it is far below the
// limit for a correction, it stays there as long as the standard errors shrink, as they do with
// every cycle, and the parameters stay within them. Computing it costs 2 q solutions of all
// runs for q parameters.
#pragma once

#include <vector>

#include "estimator/fit/estimation.hpp"

namespace shaker::estimator::online {

class BiasWatch {
 public:
  // Subtracts the bias from `estimate`, which describes the last fit of `estimator`; that fit
  // stays. Returns false if the periodic solutions may have left their branch. The next fit
  // must then not be a warm one.
  bool take_off(Estimate& estimate, Estimator& estimator, const Model& model);
  // The runs are others than before: what was seen of them says nothing now.
  // To be called when the set of runs changes: the last computed bias no longer applies.
  void reset() { seen_.clear(); }
  int looks() const { return looks_; }  // number of times that the bias was computed

 private:
  int looks_ = 0;
  double largest_ = 0.0;      // bias in standard errors, as last computed
  std::vector<double> seen_;  // standard errors then; empty: compute the bias
  std::vector<double> at_;    // theta then
};

}  // namespace shaker::estimator::online
