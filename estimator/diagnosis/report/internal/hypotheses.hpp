// The hypotheses that the campaign does not exclude, as a prediction needs them: estimates with
// covariance and probability, what of the motion was visited, and the force that nothing names.
#pragma once

#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/force/internal/force_surface.hpp"
#include "estimator/diagnosis/report/internal/model_probabilities.hpp"

namespace shaker::estimator::diagnosis {

// `said`: verdict, curves, gap and remaining force of the diagnosis; its hypotheses are `found`,
// fitted to `data`, of which `choice` has chosen by `probabilities`. The chosen one (or the base
// model) is the first of the result. Models start at the estimates. `known`: what the remaining
// force of `said` has left (remaining_force.hpp).
IdentifiedDamper identified_damper(const Selection& found, const std::vector<RunDatum>& data,
                                   const Choice& choice, const ModelProbabilities& probabilities,
                                   const Diagnosis& said, SeenPriors& known);

}  // namespace shaker::estimator::diagnosis
