// Fits of records with friction that jumps: a mass that moves or sticks (solve/time/stick_slip.cpp).
#pragma once

#include <memory>
#include <vector>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// True if the model has friction that jumps and whose width no line states, and the integration of
// these records can follow it: it has one velocity.
bool can_jump(const config::ModelSpec& spec, const std::vector<RunDatum>& data);

// `first`: the fit with a friction of some width. Null if none converges. Where a decay ends at rest
// goes to and fro as the friction grows, with the count of the swings; so the fit has a valley for
// each count. It begins in several of them, along the line on which the other parameters make up for
// the friction.
std::shared_ptr<HarmonicFit> fit_of_jumps(const HarmonicFit& first,
                                          const std::vector<RunDatum>& data, FitOptions options);

}  // namespace shaker::estimator::diagnosis
