// How every component of a run's cycles goes with time: the straight line through them.
#pragma once

#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"

namespace shaker::estimator::diagnosis {

// Per second, a component of the harmonics each. Errors count that neighbouring cycles may be alike
// by more than the line says; cosine and sine of a harmonic share theirs.
struct CycleLine {
  Eigen::VectorXd rate, error;
  double freedom = 0.0;  // behind the error of the mean; twice as many behind a harmonic's
};

// Of all runs, since they tell together how alike neighbours are. At least 3 cycles a run.
std::vector<CycleLine> lines_through(const std::vector<Eigen::MatrixXd>& cycles,
                                     const std::vector<Eigen::VectorXd>& when);

}  // namespace shaker::estimator::diagnosis
