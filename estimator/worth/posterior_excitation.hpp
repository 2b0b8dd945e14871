// What the excitation's own error adds to a posterior. Private to the sources of posterior.hpp.
//
// Whoever measures the excitation with an error e samples the posterior p(theta | y, x + e) and not
// p(theta | y, x). The response is not asked what e was: that would lean on the model being right
// to the last digit, and the estimate does not do so either. So the posterior is the mean of
// p(theta | y, x + e) over e, which moves theta by H^-1 J^T W S e to first order: each draw gets a
// normal error with the covariance that the estimate has for it.
#pragma once

#include <cstdint>
#include <vector>

#include "estimator/estimation.hpp"
#include "estimator/worth/posterior_draws.hpp"

namespace shaker::estimator {

// The part of the last fit's covariance (free x free) that the excitation's own error makes: what
// is missing in that of the same fit to an excitation known exactly. Of no size: no run has such an
// error. Throws std::invalid_argument as Estimator does.
Eigen::MatrixXd covariance_of_excitation(const Model& model, const Estimator& estimator,
                                         std::vector<RunData> runs, const EstimationOptions& how);

struct Box {
  std::vector<double> lower, upper;  // of the free parameters
};

// Moves each draw by an independent normal error of `covariance` (row by row, positive
// semidefinite) that keeps it inside of the box, and weighs the draws again. Same seed, same moves.
void move_by_excitation(Draws& draws, const Eigen::MatrixXd& covariance, const Box& box,
                        std::uint64_t seed);

}  // namespace shaker::estimator
