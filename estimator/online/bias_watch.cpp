#include "estimator/online/bias_watch.hpp"

#include <algorithm>

#include "estimator/worth/second_order.hpp"

namespace shaker::estimator::online {
namespace {

constexpr double kFarBelow = 0.5 * kSmallestBias;

// By how much the standard errors have grown at most; 0 when none is known.
double growth(const std::vector<double>& now, const std::vector<double>& then) {
  double largest = 0.0;
  for (std::size_t k = 0; k < now.size() && k < then.size(); ++k) {
    if (then[k] > 0.0) largest = std::max(largest, now[k] / then[k]);
  }
  return largest;
}

}  // namespace

bool BiasWatch::take_off(Estimate& estimate, Estimator& estimator, const Model& model) {
  const Fit& fit = estimator.last();
  if (!has_second_order(fit)) return true;
  if (!seen_.empty() && largest_ * growth(fit.standard_error, seen_) < kFarBelow) return true;
  const auto effect = second_order(estimator, model);
  take_off_bias(estimate, effect, Bias::automatic);
  seen_.clear();
  if (!effect) return false;
  largest_ = effect->largest_bias;
  seen_ = fit.standard_error;
  return true;
}

}  // namespace shaker::estimator::online
