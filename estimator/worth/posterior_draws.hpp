// Draws of a posterior with their weights, and what they say of a parameter. Private to the sources
// of posterior.hpp.
#pragma once

#include <vector>

#include <Eigen/Dense>

#include "estimator/worth/posterior.hpp"

namespace shaker::estimator {

struct Draws {
  std::vector<Eigen::VectorXd> theta;
  std::vector<double> weight;  // sum 1 after `weigh`
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
  double effective = 0.0;  // equal draws that the weighted ones are worth (Kish)
};

// Scales the weights, some of which are positive, to sum 1; mean, covariance, `effective`.
void weigh(Draws& draws);

// `count` of the draws, one of every (1 / count)-th of the probability.
std::vector<Eigen::VectorXd> even_choice(const Draws& draws, std::size_t count);

// Independent draws that the mean of parameter k is worth: its variance over the square of its
// error.
double effective_for_mean(const Draws& draws, Eigen::Index k);

// Of parameter k, the mode being known.
PosteriorMarginal marginal(const Draws& draws, Eigen::Index k, double mode, double confidence);

}  // namespace shaker::estimator
