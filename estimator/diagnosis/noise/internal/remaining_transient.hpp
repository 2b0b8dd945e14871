// The rest of the transient in cycles that look steady, and the steady cycle without it.
//
// A mode that decays by a tenth in each cycle is hidden in the scatter of single cycles, but
// visible in the mean of a dozen, which then is no periodic solution of any model. The Floquet
// modes of the fitted model say how fast a disturbance decays and what shape it has. Each cycle is
// therefore the steady one, plus the modes with amplitudes of the run, plus noise. The uncertainty
// of these amplitudes goes into the covariance of the mean. A mode that hardly decays cannot be
// separated from the steady cycle, and the covariance shows that.
#pragma once

#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/fit/internal/prediction.hpp"

namespace shaker::estimator::diagnosis {

struct DecayingModes {
  // For each cycle a matrix with one column of harmonics for each amplitude: a real mode has one, a
  // pair two. The columns of the first cycle have a length of at most 1. Empty if there is no mode
  // (an imposed motion), or if the solution is not stable.
  std::vector<Eigen::MatrixXd> of_cycle;
  double slowest = 0.0;  // modulus of the largest multiplier
};

DecayingModes decaying_modes(const Prediction& prediction, const std::vector<double>& theta,
                             int harmonics, int cycles);

struct WithoutTransient {
  Eigen::MatrixXd cycles;  // a row a cycle; their mean is the steady one
  Eigen::MatrixXd added;   // to the covariance of that mean, for what had to be estimated
  Eigen::VectorXd spent;   // degrees of freedom that this took from each component's scatter
  double first = 0.0;      // length of the transient in the first cycle
};

// `variance`: of one cycle, for each component. If the transient is so large that its square is
// visible too, the square is removed whatever its shape.
WithoutTransient without_transient(const Eigen::MatrixXd& cycles, const DecayingModes& modes,
                                   const Eigen::VectorXd& variance);

}  // namespace shaker::estimator::diagnosis
