// The noise of a record from its own spectrum: what lies above all that moves is noise. The level
// of the last fifth is carried down with a slope that is at most 1 / frequency.
#pragma once

#include <Eigen/Dense>

namespace shaker::estimator::diagnosis {

struct SpectralFloor {
  Eigen::VectorXd power;  // variance of each cosine's noise
  double freedom = 0.0;   // behind each
  Eigen::Index band = 0;  // cosines that rise above it
  bool reached = true;    // the response ends well below the end of the spectrum
};

// `series`: all cosines of a record; `size`: root mean square of its motion.
SpectralFloor trend_floor(const Eigen::VectorXd& series, double size);

// At the upper end of what its own uncertainty allows: one level serves a whole run, and must not
// raise an alarm by itself.
Eigen::VectorXd upper_power(const SpectralFloor& floor);

}  // namespace shaker::estimator::diagnosis
