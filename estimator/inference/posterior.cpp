#include "estimator/inference/posterior.hpp"

#include <algorithm>
#include <memory>
#include <stdexcept>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "estimator/inference/internal/posterior_draws.hpp"
#include "estimator/inference/internal/posterior_ensembles.hpp"
#include "estimator/inference/internal/posterior_excitation.hpp"
#include "estimator/inference/internal/posterior_importance.hpp"
#include "estimator/inference/internal/posterior_likelihood.hpp"
#include "estimator/inference/internal/posterior_valley.hpp"
#include "estimator/math/dense.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kMostValleys = 2;  // that are traced
constexpr double kPlainTail = 0.4, kPlainShare = 0.2, kPlainWidth = 1.2;
constexpr int kValleyRounds = 2;  // of importance sampling along a valley

struct Sampled {
  Draws draws;
  std::vector<double> effective;  // effective draws for each mean; empty: the draws are independent
  Posterior how;                  // everything except the statistics of the parameters
};

// True where importance sampling may be believed without walkers. A sample that never reached
// the far end of a valley does not show that it is missing. Therefore good weights are accepted
// only where Laplace's approximation excludes such a valley: no parameter scatters much more
// than it predicts. A proposal that follows draws looks good wherever these draws are, so the
// weights of the round that it follows must be as good as its own.
bool plain(const ImportanceSample& sample, const MatrixXd& covariance,
           const PosteriorOptions& options) {
  if (!sample.good) return false;
  const auto draws = static_cast<double>(sample.draws.theta.size());
  const double most = std::min(kPlainTail, options.largest_pareto_k);
  return std::max(sample.pareto_k, sample.followed_k) <= most &&
         std::min(sample.fewest_effective / draws, sample.followed_share) >= kPlainShare &&
         (sample.draws.covariance.diagonal().array() <=
          kPlainWidth * kPlainWidth * covariance.diagonal().array())
             .all();
}

// Samples along a valley, where one can be followed and improves the result; otherwise returns
// `best`.
ImportanceSample along_valleys(const std::function<LogDensity()>& make, ImportanceSample best,
                               const VectorXd& mode, const MatrixXd& covariance,
                               PosteriorOptions options) {
  options.rounds = kValleyRounds;
  LogDensity density = make();
  std::vector<Index> order = likely_valleys(covariance);
  order.resize(std::min(order.size(), kMostValleys));
  for (const Index along : order) {
    auto valley = trace_valley(density, mode, covariance, along);
    if (!valley) continue;
    ImportanceSample next = sample_by_importance(
        make, mode, covariance, options, std::make_shared<const Valley>(std::move(*valley)));
    const bool enough = next.good;
    if (enough || next.fewest_effective > best.fewest_effective) best = std::move(next);
    if (enough) break;
  }
  return best;
}

Sampled sample(const std::function<LogDensity()>& make, const VectorXd& mode,
               const MatrixXd& covariance, const PosteriorOptions& options) {
  if (mode.size() == 0 || options.samples < 100 || options.rounds < 1)
    throw std::invalid_argument("a posterior needs a mode, 100 samples or more, and a round");
  if (!covariance.allFinite() || !Cholesky(covariance).positive())
    throw std::invalid_argument(
        "the covariance around the mode is not positive definite, so there is no place to sample "
        "from; the data do not determine all parameters");
  ImportanceSample first = sample_by_importance(make, mode, covariance, options);
  const bool sure = plain(first, covariance, options), easy = sure || options.most_steps == 0;
  if (!easy) first = along_valleys(make, std::move(first), mode, covariance, options);
  Sampled out;
  out.how.pareto_k = first.pareto_k;
  out.how.inadmissible = first.inadmissible;
  out.how.effective_samples = first.fewest_effective;
  out.how.converged = sure;
  if (!easy) {
    EnsembleSample second = sample_by_ensembles(make, first, mode, covariance, options);
    // If neither is good, the ensembles are preferred: they have visited more of the posterior.
    if (!second.draws.theta.empty()) {
      out.how.method = PosteriorMethod::ensembles;
      out.how.r_hat = second.r_hat;
      out.how.effective_samples = second.fewest_effective;
      out.how.converged = second.good;
      out.effective = std::move(second.effective);
      out.draws = std::move(second.draws);
    }
  }
  if (out.draws.theta.empty()) out.draws = std::move(first.draws);
  out.how.samples = static_cast<long>(out.draws.theta.size());
  return out;
}

Posterior summarise(const Sampled& sampled, const VectorXd& mode, double confidence) {
  Posterior out = sampled.how;
  if (!(sampled.draws.effective > 1.0)) return out;
  const MatrixXd& covariance = sampled.draws.covariance;
  out.covariance.assign(covariance.data(), covariance.data() + covariance.size());
  for (Index k = 0; k < mode.size(); ++k) {
    out.parameters.push_back(marginal(sampled.draws, k, mode[k], confidence));
    if (!sampled.effective.empty())
      out.parameters.back().effective_samples = sampled.effective[static_cast<std::size_t>(k)];
  }
  return out;
}

MatrixXd square(const std::vector<double>& rows, Index size) {
  if (rows.size() != static_cast<std::size_t>(size * size))
    throw std::invalid_argument(
        "the covariance of a posterior needs a row for each element of its mode");
  return Eigen::Map<const MatrixXd>(rows.data(), size, size);
}

}  // namespace

Posterior sample_posterior(const std::function<LogDensity()>& make_density,
                           const std::vector<double>& mode, const std::vector<double>& covariance,
                           const PosteriorOptions& options) {
  const VectorXd at = Eigen::Map<const VectorXd>(mode.data(), static_cast<Index>(mode.size()));
  return summarise(sample(make_density, at, square(covariance, at.size()), options), at,
                   options.confidence);
}

Posterior posterior(const Model& model, const Estimator& estimator,
                    const std::vector<RunData>& runs, const EstimationOptions& how,
                    const PosteriorOptions& options) {
  const Fit fit = estimator.last();
  std::vector<double> free;
  Box box;
  for (std::size_t k = 0; k < fit.theta.size(); ++k) {
    const ModelParameter& p = model.parameters()[k];
    if (p.fixed) continue;
    free.push_back(fit.theta[k]);
    box.lower.push_back(p.lower);
    box.upper.push_back(p.upper);
  }
  const VectorXd mode = Eigen::Map<const VectorXd>(free.data(), static_cast<Index>(free.size()));
  MatrixXd covariance = square(fit.covariance, mode.size());
  const MatrixXd excitation = covariance_of_excitation(model, estimator, runs, how);
  const bool noisy_excitation = excitation.size() > 0;
  if (noisy_excitation) covariance -= excitation;
  Sampled sampled = sample(
      [&]() -> LogDensity {
        // std::function requires a copyable object. Each thread has its own workspace.
        auto likelihood = std::make_shared<PosteriorLikelihood>(model, estimator, runs, how);
        return [likelihood](std::span<const double> theta) { return (*likelihood)(theta); };
      },
      mode, covariance, options);
  if (noisy_excitation && sampled.draws.effective > 1.0)
    move_by_excitation(sampled.draws, excitation, box, options.seed);
  return summarise(sampled, mode, options.confidence);
}

void replace_by_posterior(Estimate& estimate, const Posterior& posterior) {
  std::size_t next = 0;
  for (ParameterEstimate& p : estimate.parameters) {
    if (p.fixed || next >= posterior.parameters.size()) continue;
    const PosteriorMarginal& marginal = posterior.parameters[next++];
    p.lower = marginal.lower;
    p.upper = marginal.upper;
  }
  if (posterior.converged) return;
  const std::string how =
      posterior.method == PosteriorMethod::ensembles
          ? fmt::format(
                "the chains differ by {:.3f} (split R-hat; 1.01 is the most) or still spread",
                posterior.r_hat)
          : fmt::format(
                "the tail of their weights has the shape {:.2f} ({:g} is the most that is believed "
                "without walkers, a fifth of the draws must be independent, and no parameter may "
                "scatter more than {:g} times as much as the linearised errors say)",
                posterior.pareto_k, kPlainTail, kPlainWidth);
  estimate.warnings.push_back(fmt::format(
      "the sampling of the posterior has not converged: its {} draws are worth {:.0f}, and {}; "
      "take "
      "profile intervals, or give a parameter that the data leave open a prior or a bound",
      posterior.samples, posterior.effective_samples, how));
}

}  // namespace shaker::estimator
