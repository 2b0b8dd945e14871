// Likelihood times priors of a model's runs, for posterior.hpp. Private to its sources.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include <Eigen/Dense>

#include "estimator/estimation.hpp"
#include "estimator/math/aligned.hpp"
#include "estimator/periodic/periodic_system.hpp"

namespace shaker::estimator {

// The logarithm of the density where there is none.
inline constexpr double kNowhere = -std::numeric_limits<double>::infinity();

// A workspace of one thread. Each run is solved from the fit's own solution, so that the answer
// depends on theta alone and is of the branch that was fitted. The arguments must outlive it.
class PosteriorLikelihood {
 public:
  // Throws std::invalid_argument for responses of several excitation periods.
  PosteriorLikelihood(const Model& model, const Estimator& estimator,
                      const std::vector<RunData>& runs, const EstimationOptions& how);

  // ln of the density of the free parameters, but for a constant; minus infinity outside of the
  // bounds and where there is no periodic solution.
  double operator()(std::span<const double> free);

 private:
  void add(const RunData& run, const PeriodicSystem& fitted);
  // Puts the free parameters into theta; what their priors say, minus infinity outside of a bound.
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
  std::vector<Eigen::MatrixXd> factors_;  // Cholesky's, of the coefficients' covariances; or empty
};

}  // namespace shaker::estimator
