// The candidates of a plan: their motion, what the rig refuses, and their information. Private to the
// sources of the plan.
#pragma once

#include <string>
#include <vector>

#include "estimator/design/plan.hpp"

namespace shaker::estimator {

// The point of linearisation: the options', or the model's starts.
std::vector<double> point_of(const Model& model, const PlanOptions& options);

// All pairs of the options' frequencies and amplitudes.
std::vector<PlanCandidate> grid_of(const PlanOptions& options);

// Whether the rig can do a run with a damper of these parameters.
bool possible_at(const Model& model, const PlanOptions& options, const std::vector<double>& theta,
                 PlanCandidate candidate);

// Solves a candidate at the point of linearisation and at each point of the prior. It is refused
// where the rig refuses one of them.
void examine(const Model& model, const PlanOptions& options, const std::vector<int>& free,
             PlanCandidate& candidate);

// Candidates about the runs of `sets`, between the present frequencies and amplitudes, that are not
// among those of the plan: `round` counts from 1, and each round is finer.
std::vector<PlanCandidate> candidates_about(const std::vector<PlanSet>& sets, const Plan& plan,
                                            const PlanOptions& options, int round);

}  // namespace shaker::estimator
