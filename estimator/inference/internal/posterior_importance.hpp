// Importance sampling of a posterior in rounds. The proposal of each round follows the draws of the
// round before. Private to the sources of posterior.hpp.
#pragma once

#include <functional>
#include <limits>
#include <memory>

#include "estimator/inference/internal/posterior_draws.hpp"
#include "estimator/inference/internal/posterior_proposal.hpp"
#include "estimator/inference/internal/posterior_valley.hpp"

namespace shaker::estimator {

struct ImportanceSample {
  explicit ImportanceSample(Proposal first) : proposal(std::move(first)) {}
  Proposal proposal;  // of the last round
  Draws draws;        // of the last round; weights smoothed (posterior_weights.hpp)
  double pareto_k = 0.0;
  double fewest_effective = 0.0;  // effective draws for the mean, the fewest of any parameter
  // Pareto k and effective share (`fewest_effective` over all draws) of the round that the proposal
  // follows; the initial values if it follows none.
  double followed_k = -std::numeric_limits<double>::infinity();
  double followed_share = 1.0;
  long inadmissible = 0;
  bool good = false;
};

// Uses `valley` if it is not null. The last round draws until every mean has
// `options.fewest_effective` effective draws, at most `options.most_samples`. The answer does not
// depend on the number of threads.
ImportanceSample sample_by_importance(const std::function<LogDensity()>& make_density,
                                      const Eigen::VectorXd& mode,
                                      const Eigen::MatrixXd& covariance,
                                      const PosteriorOptions& options,
                                      std::shared_ptr<const Valley> valley = nullptr);

}  // namespace shaker::estimator
