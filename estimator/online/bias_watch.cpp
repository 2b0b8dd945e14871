#include "estimator/online/internal/bias_watch.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/inference/second_order.hpp"

namespace shaker::estimator::online {
namespace {

constexpr double kFarBelow = 0.5 * kSmallestBias;
constexpr double kMoved = 5.0;  // standard errors; more than chance moves theta while cycles add up

// Largest factor by which a standard error has grown; 0 if none is known.
double growth(const std::vector<double>& now, const std::vector<double>& then) {
  double largest = 0.0;
  for (std::size_t k = 0; k < now.size() && k < then.size(); ++k) {
    if (then[k] > 0.0) largest = std::max(largest, now[k] / then[k]);
  }
  return largest;
}

// Largest change of a parameter, in standard errors at the last look. The model's curvature, and
// with it the bias, may differ at the new parameters.
double moved(const Fit& fit, const std::vector<double>& from, const std::vector<double>& errors) {
  double largest = 0.0;
  for (std::size_t k = 0; k < fit.theta.size() && k < from.size(); ++k) {
    if (errors[k] > 0.0) largest = std::max(largest, std::fabs(fit.theta[k] - from[k]) / errors[k]);
  }
  return largest;
}

}  // namespace

bool BiasWatch::take_off(Estimate& estimate, Estimator& estimator, const Model& model) {
  const Fit& fit = estimator.last();
  if (!has_second_order(fit)) return true;
  const bool small = !seen_.empty() && largest_ * growth(fit.standard_error, seen_) < kFarBelow;
  if (small && moved(fit, at_, seen_) < kMoved) return true;
  ++looks_;
  const auto effect = second_order(estimator, model);
  take_off_bias(estimate, effect, Bias::automatic);
  seen_.clear();
  if (!effect) return false;
  largest_ = effect->largest_bias;
  seen_ = fit.standard_error;
  at_ = fit.theta;
  return true;
}

}  // namespace shaker::estimator::online
