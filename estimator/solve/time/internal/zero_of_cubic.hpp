// Where a step reverses its velocity.
#pragma once

#include <cmath>

namespace shaker::estimator {

// Returns the zero in (0, 1) of the cubic with values v0, v1 (of different sign) and slopes d0, d1
// at its ends. Newton's method, safeguarded by bisection.
inline double zero_of_cubic(double v0, double v1, double d0, double d1) {
  double low = 0.0, high = 1.0, s = v0 / (v0 - v1);
  for (int i = 0; i < 40; ++i) {
    const double s2 = s * s, s3 = s2 * s;
    const double value = (2 * s3 - 3 * s2 + 1) * v0 + (s3 - 2 * s2 + s) * d0 +
                         (3 * s2 - 2 * s3) * v1 + (s3 - s2) * d1;
    const double slope =
        (6 * s2 - 6 * s) * (v0 - v1) + (3 * s2 - 4 * s + 1) * d0 + (3 * s2 - 2 * s) * d1;
    if ((value > 0.0) == (v0 > 0.0))
      low = s;
    else
      high = s;
    double better = s - value / slope;
    if (!(better > low && better < high)) better = 0.5 * (low + high);
    if (std::fabs(better - s) < 1e-14) return better;
    s = better;
  }
  return s;
}

}  // namespace shaker::estimator
