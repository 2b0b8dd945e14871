// The range of the measured motion, which scales the ranges of the catalogue.
#pragma once

#include <vector>

#include "estimator/diagnosis/internal/run_datum.hpp"
#include "estimator/diagnosis/score/internal/candidates.hpp"

namespace shaker::estimator::diagnosis {

// Returns the range over all runs, in the model's length unit, and that unit per s and per s^2.
MotionRange range_of(const std::vector<RunDatum>& data);
// True if each recording that is given by samples goes back a part of its way. A motion to one side
// does not tell friction from a preload. (A motion that a period brings back goes both ways.)
bool goes_both_ways(const std::vector<RunDatum>& data);
// Estimates the speed of the fastest run: the root mean square of the recorded strokes' velocity,
// times the square root of two, in the fastest part of the record. It is rough, since it includes the
// noise.
double swiftest(const Campaign& campaign);

}  // namespace shaker::estimator::diagnosis
