// Dampers that the prior of a model allows, for plans that must serve all of them.
#pragma once

#include <vector>

#include "estimator/design/plan.hpp"

namespace shaker::estimator {

// Spread evenly over the normal priors of the free parameters, within their bounds; all parameters
// of each. A parameter without a prior has its start as the mean and `spread` of it as the standard
// deviation. Always the same points. None where nothing is uncertain.
std::vector<std::vector<double>> prior_points(const Model& model, double spread);

// Takes the dampers out of `options.prior` that would leave a plan without runs: those at which the
// rig can do none of the runs that it can do at the point of linearisation, and then one by one
// those with the fewest, until all others share as many runs as the largest set has. Blocks until
// all are examined on `options.threads` threads. Returns how many it took out: all where the rig can
// do no run at the point of linearisation.
std::size_t leave_out_impossible(const Model& model, PlanOptions& options);

}  // namespace shaker::estimator
