// The posterior itself, by sampling: mean (2.12), median (2.14) and mode (2.13) of each parameter,
// and intervals that hold so much of its probability.
//
// Density: the likelihood of the data times the normal priors (3.8), inside the bounds (uniform
// priors). Unknown noise is integrated out under 1 / sigma: (SS(theta))^(-nu / 2), nu observations;
// known noise or Fourier coefficients with their covariance: exp(-SS / 2 s^2).
//
// Method: importance sampling. Draws come from a multivariate t around the mode with the covariance
// of the linearised problem (Laplace's approximation with heavy tails), then once or more from a
// mixture fitted to the weighted draws before. Draws are independent of each other, so that every
// number of threads gives bitwise the same answer, nothing has to burn in, and the method itself
// says when it fails: the weights' tail, fitted by a generalised Pareto distribution (Vehtari et
// al. 2024), has shape k; above 0.7 the means have no useful error, and `converged` is false.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "estimator/estimate.hpp"
#include "estimator/estimation.hpp"

namespace shaker::estimator {

struct PosteriorOptions {
  long samples = 4000;  // of each round
  int rounds = 4;       // the first from Laplace's approximation
  std::uint64_t seed = 1;
  unsigned threads = 0;  // 0: as many as there are; the result is the same
  double confidence = 0.95;
  double largest_pareto_k = 0.7;
  double fewest_effective = 400.0;
};

struct PosteriorMarginal {
  double mean = 0.0, median = 0.0, mode = 0.0;  // mode: of the joint density, as (2.13) has it
  double standard_deviation = 0.0;
  double lower = 0.0, upper = 0.0;  // equal tails
  double effective_samples = 0.0;   // for the mean: variance over the square of its error
};

struct Posterior {
  std::vector<PosteriorMarginal> parameters;  // in the order of the density's arguments
  std::vector<double> covariance;             // row by row
  double pareto_k = 0.0;
  double effective_samples = 0.0;
  long samples = 0, inadmissible = 0;  // drawn in the last round; of them without a solution
  bool converged = false;
};

// ln of a density, but for a constant; minus infinity where it vanishes.
using LogDensity = std::function<double(std::span<const double>)>;

// Any density: around its mode, with the covariance of its peak (row by row). `make_density` is
// called once a thread. Throws std::invalid_argument for a covariance that is not positive
// definite.
Posterior sample_posterior(const std::function<LogDensity()>& make_density,
                           const std::vector<double>& mode, const std::vector<double>& covariance,
                           const PosteriorOptions& options = {});

// Of a model's free parameters, after a converged fit of `estimator` on `runs`. Throws
// std::invalid_argument for responses of several excitation periods.
Posterior posterior(const Model& model, const Estimator& estimator,
                    const std::vector<RunData>& runs, const EstimationOptions& how,
                    const PosteriorOptions& options = {});

// Puts its intervals into an estimate of the same fit; a warning when it cannot be trusted.
void replace_by_posterior(Estimate& estimate, const Posterior& posterior);

}  // namespace shaker::estimator
