/// \file
/// Samples the posterior: mean (2.12), median (2.14) and mode (2.13) of each parameter, and
/// credible intervals.
///
/// Density: the likelihood of the data times the normal priors (3.8), inside the bounds (uniform
/// priors). Unknown noise is integrated out under the prior 1 / sigma, which gives
/// (SS(theta))^(-nu / 2) for nu observations. For known noise, or for Fourier coefficients with
/// their covariance, the density is exp(-SS / 2 s^2). A measured excitation with an error of its
/// own (RunData::excitation_error) enters to first order, as in the covariance of the estimate:
/// the posterior is the mean over the possible excitations.
///
/// First method: importance sampling. The first draws come from a multivariate t around the mode
/// with the covariance of the linearised problem (Laplace's approximation with heavy tails).
/// Later rounds use a curved t and a mixture, both fitted to the weighted draws of the round
/// before. The draws are independent. Therefore every number of threads gives bitwise the same
/// answer, no burn-in is needed, and the method detects its own failure: a generalised Pareto
/// distribution is fitted to the tail of the weights (Vehtari et al. 2024), and for a shape k
/// above 0.7 the means have no useful error. The last round draws more until the means have
/// enough effective draws.
///
/// This diagnosis cannot see a part of the posterior where no draw ever came. Therefore the
/// result is accepted only where Laplace's approximation is good: k up to 0.4 and a fifth of the
/// draws effective, both also in the round before, and no standard deviation above 1.2 times the
/// linearised one. Otherwise (for example in the curved valley of figure 13) the draws follow
/// the valley (posterior_valley.hpp), and Markov chains continue from them: four ensembles of
/// walkers, until they agree (split R-hat, Vehtari et al. 2021). `method` names the method that
/// gave the numbers; `converged` is false where neither method succeeds.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "estimator/fit/estimate.hpp"
#include "estimator/fit/estimation.hpp"

namespace shaker::estimator {

/// How sample_posterior() draws, and what it accepts.
struct PosteriorOptions {
  long samples = 4000;              ///< draws in each round; at least 100
  int rounds = 4;                   ///< at least 1; the first uses Laplace's approximation
  std::uint64_t seed = 1;           ///< of the draws
  unsigned threads = 0;             ///< 0: one for each core; the result does not depend on it
  double confidence = 0.95;         ///< level of the intervals
  double largest_pareto_k = 0.7;    ///< limit for importance draws
  double largest_r_hat = 1.01;      ///< limit for the walkers
  double fewest_effective = 400.0;  ///< required effective draws for each mean
  long most_samples = 32000;        ///< limit for the last round
  long most_steps = 200000;         ///< limit for all walkers; 0: neither valleys nor walkers
};

/// Which method gave the numbers.
enum class PosteriorMethod { importance, ensembles };

/// One argument of the density.
struct PosteriorMarginal {
  double mean = 0.0;                ///< (2.12)
  double median = 0.0;              ///< (2.14)
  double mode = 0.0;                ///< of the joint density (2.13)
  double standard_deviation = 0.0;  ///< of the marginal
  /// Credible interval with equal tails.
  /// @{
  double lower = 0.0, upper = 0.0;
  /// @}
  double effective_samples = 0.0;  ///< for the mean: variance over its squared error
};

/// What the draws say.
struct Posterior {
  std::vector<PosteriorMarginal> parameters;  ///< in the order of the density's arguments
  std::vector<double> covariance;             ///< row by row
  PosteriorMethod method = PosteriorMethod::importance;  ///< that gave the numbers
  double pareto_k = 0.0;           ///< of the last round's weights; infinite with too few draws
  double r_hat = 1.0;              ///< of the ensembles, the largest of all parameters
  double effective_samples = 0.0;  ///< the fewest for the mean of any parameter
  long samples = 0;                ///< number of draws behind these statistics
  long inadmissible = 0;           ///< draws of the last importance round with density zero
  bool converged = false;          ///< the limits of the options are kept
};

/// Logarithm of a density, without its constant; minus infinity where the density is zero.
using LogDensity = std::function<double(std::span<const double>)>;

/// Samples any density. Throws std::invalid_argument for a covariance that is not positive definite
/// or not of the mode's size, and for too few samples or rounds.
/// \param make_density each thread calls it once
/// \param mode n arguments
/// \param covariance of the density's peak, n x n, row by row
/// \param options how it draws
/// \return the posterior of the n arguments
Posterior sample_posterior(const std::function<LogDensity()>& make_density,
                           const std::vector<double>& mode, const std::vector<double>& covariance,
                           const PosteriorOptions& options = {});

/// Samples the free parameters of a model, after a converged fit of `estimator` on `runs`. Throws
/// std::invalid_argument as above and for responses of several excitation periods.
/// \param model of the estimator
/// \param estimator has converged
/// \param runs its data
/// \param how its options
/// \param options how it draws
/// \return the posterior of the free parameters
Posterior posterior(const Model& model, const Estimator& estimator,
                    const std::vector<RunData>& runs, const EstimationOptions& how,
                    const PosteriorOptions& options = {});

/// Replaces the intervals of an estimate of the same fit; adds a warning if the sampling has not
/// converged.
/// \param estimate of the same fit
/// \param posterior of its free parameters
void replace_by_posterior(Estimate& estimate, const Posterior& posterior);

}  // namespace shaker::estimator
