// The quantisation step of a sensor, and its effect on a mean cycle.
//
// Noise much smaller than the step does not blur it: every cycle is rounded in the same way, and
// the mean of many cycles is as wrong as one. The error of rounding depends on the position of the
// grid under the motion, which no record shows to a fraction of the step. It is therefore given as
// a variance over that position (Widrow and Kollar, Quantization Noise, 2008, chapters 9 and 20).
#pragma once

#include <vector>

#include <Eigen/Dense>

namespace shaker::estimator::diagnosis {

// Returns the step of which all values are multiples, from some origin, or 0 if there is none.
// Allows for values that were printed with few digits.
double quantisation_step_of(const std::vector<double>& values);

// Even sampling of a run. With a whole number of samples in a cycle, every cycle is rounded in the
// same way.
struct Sampling {
  double samples_a_cycle = 0.0;
  int cycles = 0;
};

// Variance that rounding to `quantisation_step` adds to each harmonic of the mean of the cycles.
// `curve`: harmonics of a cycle. `noise`: standard deviation of a sample before rounding, which
// blurs the steps; above three quarters of a step no error is left.
Eigen::VectorXd rounding_variance(const Eigen::VectorXd& curve, double quantisation_step,
                                  double noise, const Sampling& sampling);

}  // namespace shaker::estimator::diagnosis
