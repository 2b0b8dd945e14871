// Normal equations, and their step inside the bounds (the box): gram * delta = gradient over the
// free parameters, at the last linearisation. Private to the sources of the estimator.
#pragma once

#include <vector>

#include "estimator/fit/internal/fit_data.hpp"

namespace shaker::estimator {

struct GaussNewtonEquations {
  explicit GaussNewtonEquations(const FitData& data);

  const FitData& data;
  // Sums over all data of products of (residual, derivatives), (1 + p) x (1 + p): lower triangle.
  std::vector<double> products;
  std::vector<double> gram, gradient;
  std::vector<double> delta, delta_full;  // the step: of the free parameters, of all
  std::vector<char> pinned;               // free parameters that a profile fit holds
  double sum_of_squares = 0.0;

  void form(const std::vector<double>& theta);  // from `products`, with the priors
  // Solves (gram + lambda diag) delta = gradient inside the bounds. Returns false if the matrix is
  // not positive definite.
  bool step(const std::vector<double>& theta, double lambda);
  // Largest step relative to the parameter before or after it, whichever is larger.
  double relative_step(const std::vector<double>& theta) const;
  // The share of the step in which no parameter moves by more than `most` of its present or its
  // starting value. Far from the optimum the linearisation moves badly determined parameters by
  // orders of magnitude, into valleys from which the iteration returns slowly.
  double share_within(const std::vector<double>& theta, const std::vector<double>& start,
                      double most) const;
  // Shortens the step to share_within(theta, start, 1). Returns true if it did.
  bool cap_step(const std::vector<double>& theta, const std::vector<double>& start);
  // The function that a successful step decreases.
  double objective(const std::vector<double>& theta) const;

 private:
  void add_priors(const std::vector<double>& theta);
  bool solve_free(double lambda);
  bool stays_inside(const std::vector<double>& theta, double lambda) const;
  template <int Most>
  bool box_minimum_step(const std::vector<double>& theta, double lambda);
  std::vector<double> factors_;
  std::vector<char> held_;  // free parameters at a bound that the gradient pushes outwards
};

}  // namespace shaker::estimator
