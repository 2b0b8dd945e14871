// When to stop an iteration that converges faster than linearly.
#pragma once

#include <cmath>

namespace shaker::estimator {

// What is left to go after a step, from the rate at which steps shrink; the step itself while that
// is not known (`previous` infinite) or no good.
inline double left_after(double step, double previous) {
  const double rate = step / previous;
  return std::isfinite(previous) && rate < 0.5 ? step * rate / (1.0 - rate) : step;
}

}  // namespace shaker::estimator
