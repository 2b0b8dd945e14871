// The searches of a diagnosis in their order, and the diagnosis from the last of them. The first
// search uses the errors from the noise. If its best hypothesis leaves more, the second uses errors
// from that hypothesis. If far more is left, the third counts shares of the gap.
#pragma once

#include <vector>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/diagnose.hpp"
#include "estimator/diagnosis/select/internal/selection.hpp"

namespace shaker::estimator::diagnosis {

// `base`: fit of the base model to `data`, which are the data of `runs`. Reports progress from 0.2
// to 0.95.
Diagnosis searched(HarmonicFit base, const std::vector<RunDatum>& data,
                   const std::vector<SteadyRun>& runs, const std::vector<Candidate>& catalogue,
                   const SelectionOptions& selection, const Progress& progress);

}  // namespace shaker::estimator::diagnosis
