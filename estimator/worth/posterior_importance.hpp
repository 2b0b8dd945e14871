// Importance sampling of a posterior in rounds, each from a proposal that follows the draws of the
// one before. Private to the sources of posterior.hpp.
#pragma once

#include <functional>
#include <limits>
#include <memory>

#include "estimator/worth/posterior_draws.hpp"
#include "estimator/worth/posterior_proposal.hpp"
#include "estimator/worth/posterior_valley.hpp"

namespace shaker::estimator {

struct ImportanceSample {
  explicit ImportanceSample(Proposal first) : proposal(std::move(first)) {}
  Proposal proposal;  // of the last round
  Draws draws;        // of the last round; weights smoothed (posterior_weights.hpp)
  double pareto_k = 0.0;
  double fewest_effective = 0.0;  // draws for the mean, of the parameter that has fewest
  // Of the round whose draws the proposal follows, the share being what `fewest_effective` is of
  // all; these where it follows none.
  double followed_k = -std::numeric_limits<double>::infinity();
  double followed_share = 1.0;
  long inadmissible = 0;
  bool good = false;
};

// Along `valley`, where there is one. The last round draws until every mean is worth
// `options.fewest_effective` draws, at most `options.most_samples`. Same answer for any number of
// threads.
ImportanceSample sample_by_importance(const std::function<LogDensity()>& make_density,
                                      const Eigen::VectorXd& mode,
                                      const Eigen::MatrixXd& covariance,
                                      const PosteriorOptions& options,
                                      std::shared_ptr<const Valley> valley = nullptr);

}  // namespace shaker::estimator
