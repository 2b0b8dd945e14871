#include "estimator/inference/internal/posterior_importance.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "estimator/inference/internal/posterior_likelihood.hpp"
#include "estimator/inference/internal/posterior_weights.hpp"
#include "estimator/math/parallel.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// Draws of one proposal with the logarithms of their weights.
struct Round {
  std::vector<VectorXd> theta;
  std::vector<double> log_weight;
};

// Extends a round to `count` draws. A draw depends only on its index and the number of its round.
void extend(Round& round, const std::function<LogDensity()>& make, const Proposal& proposal,
            int number, long count, const PosteriorOptions& options) {
  const auto before = static_cast<long>(round.theta.size());
  round.theta.resize(static_cast<std::size_t>(count));
  round.log_weight.resize(static_cast<std::size_t>(count), kNowhere);
  in_parallel(count - before, options.threads, make, [&](LogDensity& density, long k) {
    const long i = before + k;
    std::seed_seq sequence{static_cast<std::uint32_t>(options.seed),
                           static_cast<std::uint32_t>(options.seed >> 32),
                           static_cast<std::uint32_t>(number), static_cast<std::uint32_t>(i)};
    std::mt19937_64 random(sequence);
    const auto at = static_cast<std::size_t>(i);
    round.theta[at] = proposal.draw(random);
    const VectorXd& theta = round.theta[at];
    const double log = density({theta.data(), static_cast<std::size_t>(theta.size())});
    if (log > kNowhere) round.log_weight[at] = log - proposal.log_density(theta);
  });
}

// Computes the statistics and diagnostics of a round into `out`.
void judge(const Round& round, const PosteriorOptions& options, ImportanceSample& out) {
  out.draws = Draws{};
  out.inadmissible = 0;
  out.fewest_effective = 0.0;
  out.good = false;
  const double most = *std::max_element(round.log_weight.begin(), round.log_weight.end());
  out.inadmissible = std::count(round.log_weight.begin(), round.log_weight.end(), kNowhere);
  if (!(most > kNowhere)) return;
  for (const double log : round.log_weight)
    out.draws.weight.push_back(log > kNowhere ? std::exp(log - most) : 0.0);
  out.draws.theta = round.theta;
  out.pareto_k = smooth_weights(out.draws.weight);
  weigh(out.draws);
  out.fewest_effective = out.draws.effective;
  for (Index k = 0; k < out.draws.mean.size(); ++k)
    out.fewest_effective = std::min(out.fewest_effective, effective_for_mean(out.draws, k));
  out.good = out.pareto_k <= options.largest_pareto_k &&
             out.fewest_effective >= std::max(options.fewest_effective, 1.0);
}

}  // namespace

ImportanceSample sample_by_importance(const std::function<LogDensity()>& make_density,
                                      const VectorXd& mode, const Eigen::MatrixXd& covariance,
                                      const PosteriorOptions& options,
                                      std::shared_ptr<const Valley> valley) {
  ImportanceSample out(Proposal(mode, covariance));
  out.proposal.follow(std::move(valley));
  Round round;
  int number = 0;
  for (;; ++number) {
    round = Round{};
    extend(round, make_density, out.proposal, number, options.samples, options);
    judge(round, options, out);
    if (number + 1 >= options.rounds || !(out.draws.effective > 1.0)) break;
    out.proposal.adapt(out.draws);
    out.followed_k = out.pareto_k;
    out.followed_share = out.fewest_effective / static_cast<double>(round.theta.size());
  }
  // More draws help if they are too few, not if the proposal is too narrow.
  while (!out.good && out.draws.effective > 1.0 && out.pareto_k <= options.largest_pareto_k) {
    const auto had = static_cast<long>(round.theta.size());
    if (had >= options.most_samples) break;
    extend(round, make_density, out.proposal, number, std::min(2 * had, options.most_samples),
           options);
    judge(round, options, out);
  }
  return out;
}

}  // namespace shaker::estimator
