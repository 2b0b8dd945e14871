// The model of the benchmarks, the start of their fits and the options of these fits.
#pragma once

#include <vector>

#include "estimator/fit/estimation.hpp"
#include "estimator/paper/figures.hpp"

namespace shaker::bench {

// 5 % above the truth.
inline const std::vector<double> kStart = {5.08 * 1.05, 5.0 * 1.05, 1.62 * 1.05, 1.05};

inline const estimator::Model& model() {
  static const estimator::Model oleo(estimator::paper::oleo_in_feet(32.2));
  return oleo;
}

inline estimator::EstimationOptions on_points(int points) {
  estimator::EstimationOptions o;
  o.grid = {estimator::Scheme::order6, points, true};
  o.tolerance = 1e-8;
  return o;
}

}  // namespace shaker::bench
