// Likelihood times priors of the runs of a model. Private to the sources of posterior.hpp.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include <Eigen/Dense>

#include "estimator/fit/estimation.hpp"
#include "estimator/math/aligned.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator {

// Logarithm of a density that is zero.
inline constexpr double kNowhere = -std::numeric_limits<double>::infinity();

// Workspace of one thread. The solution of each run starts from the fit's own solution. Therefore
// the value depends on theta only and belongs to the fitted branch. The arguments must outlive it.
class PosteriorLikelihood {
 public:
  // Throws std::invalid_argument for responses of several excitation periods.
  PosteriorLikelihood(const Model& model, const Estimator& estimator,
                      const std::vector<RunData>& runs, const EstimationOptions& how);

  // Logarithm of the density of the free parameters, without its constant; minus infinity
  // outside the bounds and where no periodic solution is found.
  double operator()(std::span<const double> free);

 private:
  void add(const RunData& run, const PeriodicSystem& fitted);
  // Copies the free parameters into theta. Returns the log density of their priors, minus infinity
  // outside a bound.
  double prior(std::span<const double> free);
  bool solve(std::size_t run);
  bool follow(std::size_t run);
  double predicted(const RunData& run, const PeriodicSystem& system, std::size_t point) const;
  double sum_of_squares(std::size_t run) const;
  double coefficients_off(std::size_t run) const;

  const Model& model_;
  const std::vector<RunData>& runs_;
  const Fit& fit_;
  const EstimationOptions& how_;
  std::vector<double> theta_, on_the_way_;
  std::vector<std::size_t> free_;
  std::vector<PeriodicSystem> systems_;
  std::vector<AlignedVector> at_mode_;
  std::vector<Eigen::MatrixXd> factors_;  // Cholesky factors of harmonic_covariance, or empty
};

}  // namespace shaker::estimator
