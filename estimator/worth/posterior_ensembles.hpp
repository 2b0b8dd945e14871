// Markov chains for posteriors that a proposal cannot follow: four ensembles of walkers, each by
// itself, every walker moving on by what the others of its ensemble have found. Private to the
// sources of posterior.hpp.
//
// A step is one of three at random, all of which leave the posterior as it is: along the difference
// of two other walkers (ter Braak 2006), along the line to another one (Goodman and Weare 2010;
// scales and correlations do not matter to either), or a draw of the importance proposal (a jump
// to where it knows of, and later to where the walkers have been). The first half of each chain is
// left out; the chains go on until they agree (split R-hat), spread no further and every mean is
// worth enough draws, or until the steps are used up.
#pragma once

#include <functional>
#include <vector>

#include "estimator/worth/posterior_importance.hpp"

namespace shaker::estimator {

struct EnsembleSample {
  Draws draws;                    // of equal weight
  std::vector<double> effective;  // draws for the mean of each parameter
  double r_hat = 0.0;             // the largest
  double fewest_effective = 0.0;
  long steps = 0;  // of all walkers, what is left out included
  bool good = false;
};

// Walkers start at draws of `start`, or around the mode where that has none. No draws where the
// density vanishes all around the mode. Same answer for any number of threads.
EnsembleSample sample_by_ensembles(const std::function<LogDensity()>& make_density,
                                   const ImportanceSample& start, const Eigen::VectorXd& mode,
                                   const Eigen::MatrixXd& covariance,
                                   const PosteriorOptions& options);

}  // namespace shaker::estimator
