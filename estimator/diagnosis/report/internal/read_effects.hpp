// Effects of the instruments that are read from the records, in addition to those from the search:
// a drift of the zero, and a quantisation step that is coarse compared with the noise.
#pragma once

#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/noise/internal/screening.hpp"

namespace shaker::estimator::diagnosis {

// Adds them to the effects, the parameters, the ranking and the improved model. `said` is the
// diagnosis of the records without the drift; its gap and parameters before become those with the
// drift. If nothing else is missing, the verdict becomes `explained`; otherwise it stays.
// `coarseness`: Weighed::coarseness. Effects that the model already has are not named.
void name_read_effects(const Screening& first, double coarseness, Diagnosis& said);

// The same for records without a period; `data` are those of the recordings. Only the quantisation
// step: a drift is a candidate of the search there.
void name_grid_of_records(const std::vector<Recording>& recordings,
                          const std::vector<RunDatum>& data, Diagnosis& said);

}  // namespace shaker::estimator::diagnosis
