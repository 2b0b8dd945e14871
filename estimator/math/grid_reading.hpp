// Reads a function of one period between the points of its grid.
#pragma once

namespace shaker::estimator {

// A value is the sum of `count` values of the grid, from point `base` on (modulo the grid), times
// their weights. As it is: the value at one point of the grid.
struct GridReading {
  int base = 0;
  int count = 1;  // 1 or 6
  double weight[6] = {1, 0, 0, 0, 0, 0};
};

// Lagrange interpolation of degree 5 on the six points around `tau`, in periods, of a grid of
// `points` equal steps.
GridReading grid_reading_at(double tau, int points);

}  // namespace shaker::estimator
