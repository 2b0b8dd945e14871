// Stopping criterion for an iteration that converges faster than linearly.
#pragma once

#include <cmath>

namespace shaker::estimator {

// Estimates the distance to the limit after a step, from the ratio to the `previous` step. Returns
// the step itself if the ratio is unknown (`previous` infinite) or not below 0.5.
inline double left_after(double step, double previous) {
  const double rate = step / previous;
  return std::isfinite(previous) && rate < 0.5 ? step * rate / (1.0 - rate) : step;
}

}  // namespace shaker::estimator
