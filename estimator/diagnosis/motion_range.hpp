// The size of the motion that was measured, which the catalogue's ranges follow.
#pragma once

#include <vector>

#include "estimator/diagnosis/run_datum.hpp"
#include "estimator/diagnosis/score/candidates.hpp"

namespace shaker::estimator::diagnosis {

// Of all runs together, in the model's own length unit, its unit per s and per s^2.
MotionRange range_of(const std::vector<RunDatum>& data);

}  // namespace shaker::estimator::diagnosis
