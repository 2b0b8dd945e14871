// Fits of records with friction that jumps: a mass that moves or sticks (solve/time/stick_slip.cpp).
#pragma once

#include <memory>
#include <vector>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// True if the model has friction that jumps and whose width no line states, and the integration of
// these records can follow it: it has one velocity, and no effect with a memory, which would be stiff.
bool can_jump(const config::ModelSpec& spec, const std::vector<RunDatum>& data);

// The fit of friction that jumps, from `near`, whose friction may have a width. Null if it does not
// converge.
std::shared_ptr<const HarmonicFit> fit_of_jumps(const HarmonicFit& near,
                                                const std::vector<RunDatum>& data,
                                                FitOptions options);

}  // namespace shaker::estimator::diagnosis
