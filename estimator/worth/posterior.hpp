// The posterior itself, by sampling: mean (2.12), median (2.14) and mode (2.13) of each parameter,
// and intervals that hold so much of its probability.
//
// Density: the likelihood of the data times the normal priors (3.8), inside the bounds (uniform
// priors). Unknown noise is integrated out under 1 / sigma: (SS(theta))^(-nu / 2), nu observations;
// known noise or Fourier coefficients with their covariance: exp(-SS / 2 s^2). A measured
// excitation with an error of its own (RunData::excitation_error) counts as in the estimate's
// covariance, to first order: the posterior is the mean over the excitations that it may have been.
//
// Method, first: importance sampling. Draws come from a multivariate t around the mode with the
// covariance of the linearised problem (Laplace's approximation with heavy tails), then once or
// more from a bent one and a mixture fitted to the weighted draws before. Draws are independent of
// each other, so that every number of threads gives bitwise the same answer, nothing has to burn
// in, and the method itself says when it fails: the weights' tail, fitted by a generalised Pareto
// distribution (Vehtari et al. 2024), has shape k; above 0.7 the means have no useful error. More
// is drawn until the means are worth enough draws.
//
// That may fail to notice a part of the posterior where no draw ever came. So it is believed only
// where Laplace's approximation is good (k up to 0.4, a fifth of the draws independent, both in the
// round before as well, and no parameter scatters more than 1.2 times as much). Elsewhere
// (a curved valley, as on figure 13), and where k is too large or no number of draws suffices,
// draws come along the valley (posterior_valley.hpp), and Markov chains go on from them: four
// ensembles of walkers, until they agree (split R-hat, Vehtari et al. 2021). `method` says which it
// was; `converged` is false where neither will do.
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
  double largest_r_hat = 1.01;
  double fewest_effective = 400.0;  // that the mean of each parameter is worth
  long most_samples = 32000;        // of the last round
  long most_steps = 200000;         // of all walkers together; 0: neither valleys nor walkers
};

enum class PosteriorMethod { importance, ensembles };

struct PosteriorMarginal {
  double mean = 0.0, median = 0.0, mode = 0.0;  // mode: of the joint density, as (2.13) has it
  double standard_deviation = 0.0;
  double lower = 0.0, upper = 0.0;  // equal tails
  double effective_samples = 0.0;   // for the mean: variance over the square of its error
};

struct Posterior {
  std::vector<PosteriorMarginal> parameters;  // in the order of the density's arguments
  std::vector<double> covariance;             // row by row
  PosteriorMethod method = PosteriorMethod::importance;
  double pareto_k = 0.0;           // of the last round's weights; infinite where none can be told
  double r_hat = 1.0;              // of the ensembles, the largest of any parameter
  double effective_samples = 0.0;  // that the mean of the parameter which has fewest is worth
  long samples = 0;                // that the numbers are of
  long inadmissible = 0;           // of the last round's draws, without a solution
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
