// What is left of the transient in cycles that look steady, and the steady cycle without it.
//
// A mode that shrinks by a tenth a cycle hides in one cycle's scatter and stands out of the mean of
// a dozen, which then is no periodic solution of any model. How fast a disturbance dies and what it
// looks like is known from the fitted model: its Floquet modes. So the cycles are a steady one, the
// modes with amplitudes of the run's own, and noise; what estimating those amplitudes costs goes
// into the mean's covariance. A mode that hardly shrinks cannot be told from the steady cycle, and
// the covariance says so.
#pragma once

#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/fit/prediction.hpp"

namespace shaker::estimator::diagnosis {

struct DecayingModes {
  // Harmonics, for each cycle a matrix of a column an amplitude: real modes have one, pairs two,
  // and the first cycle's columns are of length 1 or less. Empty: there is no mode (an imposed
  // motion), or the solution is not stable.
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

// `variance`: of one cycle, a component each. Where the transient is so large that its square shows
// too, that is taken out in whatever shape it has.
WithoutTransient without_transient(const Eigen::MatrixXd& cycles, const DecayingModes& modes,
                                   const Eigen::VectorXd& variance);

}  // namespace shaker::estimator::diagnosis
