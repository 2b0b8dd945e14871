// The size of the motion that was measured, which the catalogue's ranges follow.
#pragma once

#include <vector>

#include "estimator/discrepancy/detect/candidates.hpp"
#include "estimator/discrepancy/run_datum.hpp"

namespace shaker::estimator::discrepancy {

// Of all runs together, in the model's own length unit, its unit per s and per s^2.
MotionRange range_of(const std::vector<RunDatum>& data);

}  // namespace shaker::estimator::discrepancy
