// From what was found to what is said: gaps, parameters, probabilities, the improved model.
#pragma once

#include <vector>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/select/selection.hpp"

namespace shaker::estimator::diagnosis {

// `runs` in the order of `data`, behind which there may be their further channels; `measured` are
// the data with the noise that they were measured with, where `data` hold a model's error besides.
Diagnosis assemble(const Selection& found, const std::vector<RunDatum>& data,
                   const std::vector<SteadyRun>& runs, const std::vector<Candidate>& candidates,
                   const std::vector<RunDatum>& measured);

}  // namespace shaker::estimator::diagnosis
