// Stationarity of a series of cycles: when the transient has decayed, whether a trend remains, and
// whether the response repeats only every second, third or fourth cycle. An alternation that decays
// is the rest of a transient; once it is below the noise, it is a trend. Rows are cycles, columns
// the components of a curve (harmonics).
#pragma once

#include <Eigen/Dense>

namespace shaker::estimator {

// `least`: standard deviation of each component from rounding. If the noise does not blur the
// quantisation steps, cycles repeat in patterns below that level.

// Number of cycles at the beginning that differ from those of the last half; at most two thirds of
// all.
int cycles_of_transient(const Eigen::MatrixXd& cycles, double least = 0.0);

struct Stationarity {
  bool trend = false;
  int subharmonic = 0;
  bool dying = false;  // it is none: it shrinks
};
Stationarity stationarity_of(const Eigen::MatrixXd& cycles, double least = 0.0);

}  // namespace shaker::estimator
