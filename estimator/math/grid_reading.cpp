#include "estimator/math/grid_reading.hpp"

#include <cmath>

namespace shaker::estimator {

GridReading grid_reading_at(double tau, int points) {
  GridReading reading;
  const double at = (tau - std::floor(tau)) * points;
  const int first = static_cast<int>(std::floor(at)) - 2;
  reading.base = (first + points) % points;
  reading.count = 6;
  for (int k = 0; k < 6; ++k) {
    reading.weight[k] = 1.0;
    for (int m = 0; m < 6; ++m) {
      if (m != k) reading.weight[k] *= (at - (first + m)) / (k - m);
    }
  }
  return reading;
}

}  // namespace shaker::estimator
