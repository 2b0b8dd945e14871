// Stationarity of a series of cycles: when the transient has decayed, whether a trend remains, and
// whether the response repeats only every second, third or fourth cycle. An alternation that decays
// is the rest of a transient; once it is below the noise, it is a trend. Rows are cycles, columns
// the components of a curve (harmonics).
#pragma once

#include <vector>

#include <Eigen/Dense>

namespace shaker::estimator {

// What makes cycles differ in an order of its own, beside noise, in each component.
struct ExpectedScatter {
  // Standard deviation from rounding. If the noise does not blur the quantisation steps, cycles repeat in
  // patterns below that level.
  double rounding = 0.0;
  // The most by where the samples lie along a jump, and for each cycle where they do, in sampling
  // intervals. Cycles whose samples lie alike have the same error; empty: there is none.
  double sampling = 0.0;
  std::vector<double> offsets;
};

// Number of cycles at the beginning that differ from those of the last half; at most two thirds of
// all.
int cycles_of_transient(const Eigen::MatrixXd& cycles, const ExpectedScatter& expected = {});

struct Stationarity {
  bool trend = false;
  int subharmonic = 0;
  bool dying = false;  // it is none: it shrinks
};
Stationarity stationarity_of(const Eigen::MatrixXd& cycles, const ExpectedScatter& expected = {});

}  // namespace shaker::estimator
