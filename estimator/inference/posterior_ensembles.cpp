#include "estimator/inference/internal/posterior_ensembles.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "estimator/inference/internal/posterior_convergence.hpp"
#include "estimator/inference/internal/posterior_likelihood.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/math/parallel.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kEnsembles = 4;
constexpr std::size_t kFewestWalkers = 16;  // at least, or four for each parameter
constexpr long kFirstSweeps = 200;
constexpr double kJitter = 0.3;   // of the standard deviation, so that all walkers start apart
constexpr double kGrowth = 0.05;  // largest relative growth of a standard deviation over a stage
constexpr double kStretch = 2.0;  // Goodman and Weare's a

struct Walker {
  VectorXd theta;
  double log = kNowhere;       // log density of the posterior
  double log_draw = kNowhere;  // log density of the proposal
};

struct Ensemble {
  std::vector<Walker> walkers;
  std::vector<VectorXd> path;  // sweep by sweep, walker by walker
  std::mt19937_64 random;
  double uniform() { return std::uniform_real_distribution<double>(0.0, 1.0)(random); }
  // A random walker that is neither `a` nor `b`.
  std::size_t another(std::size_t a, std::size_t b) {
    std::uniform_int_distribution<std::size_t> any(0, walkers.size() - 1);
    for (;;) {
      if (const std::size_t k = any(random); k != a && k != b) return k;
    }
  }
};

class Sampler {
 public:
  Sampler(LogDensity& density, const Proposal& proposal) : density_(density), proposal_(proposal) {}

  Walker look(const VectorXd& theta) const {
    return {theta, density_({theta.data(), static_cast<std::size_t>(theta.size())}),
            proposal_.log_density(theta)};
  }

  void sweep(Ensemble& ensemble) const {
    for (std::size_t i = 0; i < ensemble.walkers.size(); ++i) {
      const double kind = ensemble.uniform();
      double log_ratio = 0.0;  // of the reverse and the forward proposal
      const Walker next = kind < 1.0 / 3.0   ? jump(ensemble, i, log_ratio)
                          : kind < 2.0 / 3.0 ? stretch(ensemble, i, log_ratio)
                                             : differ(ensemble, i);
      Walker& walker = ensemble.walkers[i];
      const double chance = next.log - walker.log + log_ratio;
      if (next.log > kNowhere && std::log(ensemble.uniform()) < chance) walker = next;
      ensemble.path.push_back(walker.theta);
    }
  }

 private:
  Walker jump(Ensemble& ensemble, std::size_t i, double& log_ratio) const {
    Walker next = look(proposal_.draw(ensemble.random));
    log_ratio = ensemble.walkers[i].log_draw - next.log_draw;
    return next;
  }

  Walker stretch(Ensemble& ensemble, std::size_t i, double& log_ratio) const {
    const VectorXd& other = ensemble.walkers[ensemble.another(i, i)].theta;
    const double root = 1.0 + (kStretch - 1.0) * ensemble.uniform();
    const double z = root * root / kStretch;
    log_ratio = (static_cast<double>(other.size()) - 1.0) * std::log(z);
    return look(other + z * (ensemble.walkers[i].theta - other));
  }

  Walker differ(Ensemble& ensemble, std::size_t i) const {
    const std::size_t a = ensemble.another(i, i), b = ensemble.another(i, a);
    const VectorXd& theta = ensemble.walkers[i].theta;
    // Sometimes the full difference, which jumps from one mode to another.
    const double part = ensemble.uniform() < 0.1
                            ? 1.0
                            : 2.38 / std::sqrt(2.0 * static_cast<double>(theta.size())) *
                                  (0.5 + ensemble.uniform());
    return look(theta + part * (ensemble.walkers[a].theta - ensemble.walkers[b].theta));
  }

  LogDensity& density_;
  const Proposal& proposal_;
};

std::vector<Ensemble> begin(LogDensity density, const ImportanceSample& start, const VectorXd& mode,
                            const MatrixXd& covariance, const PosteriorOptions& options) {
  const Sampler sampler(density, start.proposal);
  const std::size_t size = std::max(kFewestWalkers, 4 * static_cast<std::size_t>(mode.size()));
  std::vector<VectorXd> from;
  if (start.draws.effective > 1.0) from = even_choice(start.draws, kEnsembles * size);
  from.resize(kEnsembles * size, mode);
  const MatrixXd root = Cholesky(covariance).root();
  std::normal_distribution<double> normal;
  std::vector<Ensemble> out(kEnsembles);
  for (std::size_t e = 0; e < kEnsembles; ++e) {
    std::seed_seq sequence{static_cast<std::uint32_t>(options.seed),
                           static_cast<std::uint32_t>(options.seed >> 32), 0xE75EU,
                           static_cast<std::uint32_t>(e)};
    out[e].random.seed(sequence);
    for (std::size_t i = 0; i < size; ++i) {
      VectorXd z(mode.size());
      for (double& value : z)
        value = normal(out[e].random);
      const VectorXd& centre = from[i * kEnsembles + e];
      Walker walker = sampler.look(centre + kJitter * root * z);
      for (double less = 0.5; !(walker.log > kNowhere) && less > 1e-6; less *= 0.5)
        walker = sampler.look(mode + less * kJitter * root * z);
      out[e].walkers.push_back(std::move(walker));
    }
  }
  return out;
}

// Computes the statistics and the convergence of the sweeps from `first_sweep` on.
void judge(const std::vector<Ensemble>& ensembles, long first_sweep,
           const PosteriorOptions& options, EnsembleSample& out) {
  const std::size_t size = ensembles.front().walkers.size();
  const std::size_t first = static_cast<std::size_t>(first_sweep) * size;
  const MatrixXd before = std::move(out.draws.covariance);
  out.draws = Draws{};
  for (const Ensemble& ensemble : ensembles)
    out.draws.theta.insert(out.draws.theta.end(),
                           ensemble.path.begin() + static_cast<std::ptrdiff_t>(first),
                           ensemble.path.end());
  out.draws.weight.assign(out.draws.theta.size(), 1.0);
  weigh(out.draws);
  out.effective.clear();
  out.r_hat = 1.0;
  for (Index k = 0; k < out.draws.mean.size(); ++k) {
    std::vector<std::vector<double>> single, means;
    for (const Ensemble& ensemble : ensembles) {
      single.emplace_back();
      means.emplace_back();
      for (std::size_t at = first; at < ensemble.path.size(); ++at) {
        const double value = ensemble.path[at][k];
        single.back().push_back(value);
        if ((at - first) % size == 0) means.back().push_back(0.0);
        means.back().back() += value / static_cast<double>(size);
      }
    }
    out.r_hat = std::max(out.r_hat, split_r_hat(single));
    out.effective.push_back(effective_of_chains(means, out.draws.covariance(k, k)));
  }
  out.fewest_effective = *std::min_element(out.effective.begin(), out.effective.end());
  // Walkers that all start in one part of a long valley agree while they still spread along it.
  const bool settled =
      before.size() > 0 &&
      ((out.draws.covariance.diagonal().array() / before.diagonal().array()).sqrt() <=
       1.0 + kGrowth)
          .all();
  out.good = settled && out.r_hat <= options.largest_r_hat &&
             out.fewest_effective >= options.fewest_effective;
}

}  // namespace

EnsembleSample sample_by_ensembles(const std::function<LogDensity()>& make_density,
                                   const ImportanceSample& start, const VectorXd& mode,
                                   const MatrixXd& covariance, const PosteriorOptions& options) {
  std::vector<Ensemble> ensembles = begin(make_density(), start, mode, covariance, options);
  for (const Ensemble& ensemble : ensembles) {
    for (const Walker& walker : ensemble.walkers)
      if (!(walker.log > kNowhere)) return {};
  }
  const auto size = static_cast<long>(ensembles.front().walkers.size() * kEnsembles);
  EnsembleSample out;
  Proposal proposal = start.proposal;
  long done = 0;
  for (long sweeps = kFirstSweeps;; sweeps *= 2) {
    const long last = std::min(sweeps, options.most_steps / size);
    if (last <= done) return out;
    in_parallel(
        static_cast<long>(kEnsembles), options.threads, make_density,
        [&](LogDensity& density, long e) {
          const Sampler sampler(density, proposal);
          for (long sweep = done; sweep < last; ++sweep)
            sampler.sweep(ensembles[static_cast<std::size_t>(e)]);
        },
        1);
    judge(ensembles, std::max(done, last / 2), options, out);
    done = last;
    out.steps = done * size;
    if (out.good) return out;
    // The proposal follows the draws so far. The next draws that are kept all come after this
    // change.
    proposal.adapt(out.draws);
    for (Ensemble& ensemble : ensembles) {
      for (Walker& walker : ensemble.walkers)
        walker.log_draw = proposal.log_density(walker.theta);
    }
  }
}

}  // namespace shaker::estimator
