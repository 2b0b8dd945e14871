// Markov chains for posteriors that an importance proposal cannot follow: four independent
// ensembles of walkers, in which each walker uses the positions of the others of its ensemble.
// Private to the sources of posterior.hpp.
//
// A step is one of three at random, all of which leave the posterior invariant:
// - along the difference of two other walkers (ter Braak 2006);
// - along the line to another walker (Goodman and Weare 2010); like the first, this step is
//   independent of scales and correlations;
// - a draw of the importance proposal, which later follows the draws of the walkers.
// The first half of each chain is discarded. The chains continue until they agree (split
// R-hat), their spread no longer grows and every mean has enough effective draws, or until the
// steps are used up.
#pragma once

#include <functional>
#include <vector>

#include "estimator/inference/internal/posterior_importance.hpp"

namespace shaker::estimator {

struct EnsembleSample {
  Draws draws;                    // of equal weight
  std::vector<double> effective;  // effective draws for each mean
  double r_hat = 0.0;             // the largest
  double fewest_effective = 0.0;
  long steps = 0;  // of all walkers, with the discarded ones
  bool good = false;
};

// The walkers start near draws of `start`, or near the mode where `start` has none. Returns no
// draws when a walker finds no start with a positive density, or when the steps do not suffice
// for one sweep. The answer does not depend on the number of threads.
EnsembleSample sample_by_ensembles(const std::function<LogDensity()>& make_density,
                                   const ImportanceSample& start, const Eigen::VectorXd& mode,
                                   const Eigen::MatrixXd& covariance,
                                   const PosteriorOptions& options);

}  // namespace shaker::estimator
