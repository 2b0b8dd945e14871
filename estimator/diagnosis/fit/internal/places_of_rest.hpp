// Where the model is at rest, and where a spring beside it may be.
#pragma once

#include <vector>

#include "estimator/model/model.hpp"

namespace shaker::estimator::diagnosis {

// True if the model makes no force at rest in its zero. Where a record has its zero is then nothing
// that the model says.
bool rests_at_zero(const Model& model, const std::vector<double>& theta);

// A stretch of the stroke.
struct PlacesOfRest {
  double low = 0.0, high = 0.0;
};

// Returns where a spring beside the model may be at rest, with a motion from `low` to `high`: within
// the motion, or between it and zero. A damper that has a zero of its own (a gas column) may be beside
// a spring that is preloaded there: it rests as far beyond zero as the motion goes, at most. Farther
// outside, a force that bends about its place of rest is nearly a constant: a preload, or friction
// along a motion to one side.
PlacesOfRest places_of_rest(bool own_zero, double low, double high);

}  // namespace shaker::estimator::diagnosis
