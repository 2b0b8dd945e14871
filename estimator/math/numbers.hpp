// Constants that many parts of the estimator use.
#pragma once

#include <cmath>
#include <limits>
#include <numbers>

namespace shaker::estimator {

inline constexpr double kTwoPi = 2.0 * std::numbers::pi;
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Reference size for a change of a parameter: its magnitude, or 1 in its own unit if it is zero.
inline double size_of(double theta) {
  return theta != 0.0 ? std::fabs(theta) : 1.0;
}

}  // namespace shaker::estimator
