// The noise of a record from its own spectrum: above the frequencies of all motion there is only
// noise. The level of the last fifth is extrapolated to lower frequencies, with a slope of at most
// 1 / frequency.
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

// The upper end of the uncertainty of the level. One level serves a whole run and must not raise an
// alarm by its own error.
Eigen::VectorXd upper_power(const SpectralFloor& floor);

}  // namespace shaker::estimator::diagnosis
