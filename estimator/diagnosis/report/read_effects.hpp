// What the records themselves show of their instruments, beside what the search found: a zero that
// drifts, and a grid that is coarse against the noise.
#pragma once

#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/noise/screening.hpp"

namespace shaker::estimator::diagnosis {

// Adds them to the effects, the parameters, the ranking and the improved model. `said` is of the
// records without the drift; its gap before, and its parameters before, become those with it. The
// verdict stays what the rest deserves: nothing else missing makes it `explained`.
// `coarseness`: Weighed::coarseness. Nothing is named that the model holds already.
void name_read_effects(const Screening& first, double coarseness, Diagnosis& said);

// The same for records without a period, `data` of the recordings: the grid only. A drift is a
// candidate there.
void name_grid_of_records(const std::vector<Recording>& recordings,
                          const std::vector<RunDatum>& data, Diagnosis& said);

}  // namespace shaker::estimator::diagnosis
