// The gap before and after, of all runs together and run by run.
#pragma once

#include <vector>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/noise/internal/residual.hpp"

namespace shaker::estimator::diagnosis {

// Fills the gap and the runs of `said`. The noise floor is that of `measured`, the data with the
// errors from the noise. `runs` are in the order of `data`. Returns the level above which the gap
// after of runs that were not fitted is no chance, if nothing but noise is left: two standard
// deviations above what noise and uncertain parameters make; 0 where all runs are needed to fit.
double tell_gaps(const Fitted& before, const Fitted& after, const std::vector<RunDatum>& data,
                 const std::vector<RunDatum>& measured, const std::vector<SteadyRun>& runs,
                 Diagnosis& said);

}  // namespace shaker::estimator::diagnosis
