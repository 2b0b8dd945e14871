// Inference from a fit: covariance (3.27), noise (3.28), condition. Contributions that widen the
// covariance are in fit_inference_covariance.cpp, undetermined parameters in
// fit_inference_singular.cpp, intervals (3.29) in estimation_description.cpp. Private to the
// sources of the estimator.
#pragma once

#include <vector>

#include "estimator/fit/internal/gauss_newton_equations.hpp"
#include "estimator/fit/internal/periodic_solutions.hpp"

namespace shaker::estimator {

class FitInference {
 public:
  FitInference(const FitData& data, PeriodicSolutions& solutions, GaussNewtonEquations& equations,
               Fit& fit);
  // Completes the fit from the present linearisation.
  void finish();
  // Completes the fit from the sum of squared residuals and the normal equations. Returns false if
  // these are too large or too badly conditioned, so that the Jacobian must be read.
  bool finish_from(double residuals);
  // Sum of squared residuals.
  double residual_sum() const;
  // Inverse of the Gram matrix of the last fit, free x free.
  const std::vector<double>& inverse_gram() const { return inverse_gram_; }

 private:
  bool look_anew();
  void finish_errors();
  void finish_noise();
  bool finish_definite();
  void finish_by_svd();
  void forget_undetermined();
  void add_excitation_error();
  void adjust_for_estimated_covariance();
  const FitData& data_;
  PeriodicSolutions& solutions_;
  GaussNewtonEquations& equations_;
  Fit& fit_;
  std::vector<double> inverse_gram_, scale_;
};

}  // namespace shaker::estimator
