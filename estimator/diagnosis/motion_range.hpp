// The range of the measured motion, which scales the ranges of the catalogue.
#pragma once

#include <vector>

#include "estimator/diagnosis/run_datum.hpp"
#include "estimator/diagnosis/score/candidates.hpp"

namespace shaker::estimator::diagnosis {

// Returns the range over all runs, in the model's length unit, and that unit per s and per s^2.
MotionRange range_of(const std::vector<RunDatum>& data);

}  // namespace shaker::estimator::diagnosis
