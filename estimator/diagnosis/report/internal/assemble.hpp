// Makes the diagnosis from the selection: gaps, parameters, probabilities, the improved model.
#pragma once

#include <vector>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/select/internal/selection.hpp"

namespace shaker::estimator::diagnosis {

// `runs` are in the order of `data`, which may end with their further channels. `measured` are the
// data with the errors from the noise; those of `data` may include the residual of a model.
Diagnosis assemble(const Selection& found, const std::vector<RunDatum>& data,
                   const std::vector<SteadyRun>& runs, const std::vector<Candidate>& candidates,
                   const std::vector<RunDatum>& measured);

}  // namespace shaker::estimator::diagnosis
