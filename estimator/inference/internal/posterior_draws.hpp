// Weighted draws of a posterior and their statistics. Private to the sources of posterior.hpp.
#pragma once

#include <vector>

#include <Eigen/Dense>

#include "estimator/inference/posterior.hpp"

namespace shaker::estimator {

struct Draws {
  std::vector<Eigen::VectorXd> theta;
  std::vector<double> weight;  // sum 1 after `weigh`
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
  double effective = 0.0;  // effective sample size of the weights (Kish)
};

// Scales the weights to sum 1 and computes mean, covariance and `effective`. At least one weight is
// positive.
void weigh(Draws& draws);

// Systematic resampling: `count` draws, one for each (1 / count)-th of the probability.
std::vector<Eigen::VectorXd> even_choice(const Draws& draws, std::size_t count);

// Effective number of independent draws for the mean of parameter k: its variance over its squared
// error.
double effective_for_mean(const Draws& draws, Eigen::Index k);

// Statistics of parameter k with equal-tailed intervals. `mode` is copied into the result.
PosteriorMarginal marginal(const Draws& draws, Eigen::Index k, double mode, double confidence);

}  // namespace shaker::estimator
