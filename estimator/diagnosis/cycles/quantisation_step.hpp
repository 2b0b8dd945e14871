// Values that stand on a grid: a sensor's smallest step, and what it does to a mean cycle.
//
// Noise much smaller than the step does not blur it: every cycle is then rounded in the same way,
// and the mean of many is as wrong as one. What rounding adds is known but for the place of the
// grid under the motion, which no record tells to a fraction of the step; so it is told as a
// variance over that place (Widrow and Kollar, Quantization Noise, 2008, chapters 9 and 20).
#pragma once

#include <vector>

#include <Eigen/Dense>

namespace shaker::estimator::diagnosis {

// The step of which all values are whole multiples, from some origin; 0 when there is none. Digits
// that were cut off in print are allowed for.
double quantisation_step_of(const std::vector<double>& values);

// Even sampling of a run. A whole number of samples a cycle meets the same steps in every cycle.
struct Sampling {
  double samples_a_cycle = 0.0;
  int cycles = 0;
};

// Variance of each harmonic of what rounding to steps of `quantisation_step` adds to the mean of
// the cycles of a curve, given by its harmonics. `noise`: standard deviation of a sample before it
// is rounded, which blurs the steps; above three quarters of a step nothing is left of them.
Eigen::VectorXd rounding_variance(const Eigen::VectorXd& curve, double quantisation_step,
                                  double noise, const Sampling& sampling);

}  // namespace shaker::estimator::diagnosis
