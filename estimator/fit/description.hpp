// Converts a fit into an estimate that can be published, with names, units, intervals and warnings.
//
// This function knows the numbers only. Estimator::describe adds the runs, the cycles and the
// branch of the solutions.
#pragma once

#include "estimator/fit/estimate.hpp"
#include "estimator/fit/estimation.hpp"

namespace shaker::estimator {

Estimate describe(const Model& model, const Fit& fit);

}  // namespace shaker::estimator
