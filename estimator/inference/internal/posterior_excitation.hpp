// Adds the measurement error of the excitation to a posterior. Private to the sources of
// posterior.hpp.
//
// If the excitation was measured with an error e, the sampled posterior is p(theta | y, x + e), not
// p(theta | y, x). The response is not used to infer e, because that would require the model to be
// exact; the estimate does not use it either. Therefore the posterior is the mean of
// p(theta | y, x + e) over e. To first order e moves theta by H^-1 J^T W S e, so each draw gets a
// normal error with the covariance that the estimate computes for it.
#pragma once

#include <cstdint>
#include <vector>

#include "estimator/fit/estimation.hpp"
#include "estimator/inference/internal/posterior_draws.hpp"

namespace shaker::estimator {

// The part of the last fit's covariance (free x free) that comes from the excitation's error:
// its difference from the covariance of the same fit to an exact excitation. Empty (0 x 0) if
// no run has such an error. Throws std::invalid_argument as Estimator does.
Eigen::MatrixXd covariance_of_excitation(const Model& model, const Estimator& estimator,
                                         std::vector<RunData> runs, const EstimationOptions& how);

struct Box {
  std::vector<double> lower, upper;  // of the free parameters
};

// Adds an independent normal error of `covariance` (free x free, positive semidefinite) to each
// draw and computes the statistics again. A draw that 100 errors would all move out of `box`
// stays. The result depends on the seed only.
void move_by_excitation(Draws& draws, const Eigen::MatrixXd& covariance, const Box& box,
                        std::uint64_t seed);

}  // namespace shaker::estimator
