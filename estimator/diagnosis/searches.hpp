// The searches of a diagnosis, one after the other, and what the last of them says: by the noise;
// where even the best leaves more than that, with errors as the best tells them; and where it
// leaves far more, by shares of the gap.
#pragma once

#include <vector>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/diagnose.hpp"
#include "estimator/diagnosis/select/selection.hpp"

namespace shaker::estimator::diagnosis {

// `base`: the base model's fit to `data`, which are of `runs`. Progress from 0.2 to 0.95.
Diagnosis searched(HarmonicFit base, const std::vector<RunDatum>& data,
                   const std::vector<SteadyRun>& runs, const std::vector<Candidate>& catalogue,
                   const SelectionOptions& selection, const Progress& progress);

}  // namespace shaker::estimator::diagnosis
