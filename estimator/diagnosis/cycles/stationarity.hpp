// What the succession of cycles says: when the transient has died, whether a trend is left, and
// whether the response repeats only every second, third or fourth cycle. An alternation that dies
// away is the rest of a transient, and once it has sunk into the noise, a trend. Rows are cycles,
// columns the components of a curve (harmonics).
#pragma once

#include <Eigen/Dense>

namespace shaker::estimator::diagnosis {

// `least`: standard deviation of each component that is expected anyhow, because the samples are
// rounded: where noise does not blur the steps, cycles repeat in ways of their own below it.

// Cycles at the beginning that are not yet like those of the last half; at most two thirds.
int cycles_of_transient(const Eigen::MatrixXd& cycles, double least = 0.0);

struct Stationarity {
  bool trend = false;
  int subharmonic = 0;
  bool dying = false;  // it is none: it shrinks
};
Stationarity examine(const Eigen::MatrixXd& cycles, double least = 0.0);

}  // namespace shaker::estimator::diagnosis
