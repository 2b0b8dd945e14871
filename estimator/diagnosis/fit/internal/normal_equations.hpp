// The normal equations of a fit to harmonics or cosines: whitened, with the priors of the parameters
// and the error of the time base.
#pragma once

#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

struct NormalEquations {
  Eigen::MatrixXd gram;
  Eigen::VectorXd gradient;
  double chi_squared = 0.0;
  std::vector<Eigen::MatrixXd> jacobian;  // whitened, of the runs that count
  Eigen::VectorXd with_clock;             // its products with the influence of the time base
};

// `theta` is where the fit's predictions are. Square and gradient are of the free parameters.
NormalEquations normal_equations(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                 const std::vector<double>& theta);

// The gradient of chi-squared at what is predicted now, by the slopes of `before`.
Eigen::VectorXd gradient_by(const NormalEquations& before, const HarmonicFit& fit,
                            const std::vector<RunDatum>& data, const std::vector<double>& theta);

}  // namespace shaker::estimator::diagnosis
