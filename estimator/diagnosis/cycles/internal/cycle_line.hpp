// The straight line through the cycles of a run, for each component of their harmonics.
#pragma once

#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"

namespace shaker::estimator::diagnosis {

// Rate of change per second of each component. The errors include the correlation of neighbouring
// cycles about the line. Cosine and sine of a harmonic share an error.
struct CycleLine {
  Eigen::VectorXd rate, error;
  double freedom = 0.0;  // behind the error of the mean; twice as many behind a harmonic's
};

// Computes the lines of all runs. The runs together show how neighbouring cycles correlate. Each
// run needs at least 3 cycles.
std::vector<CycleLine> lines_through(const std::vector<Eigen::MatrixXd>& cycles,
                                     const std::vector<Eigen::VectorXd>& when);

}  // namespace shaker::estimator::diagnosis
