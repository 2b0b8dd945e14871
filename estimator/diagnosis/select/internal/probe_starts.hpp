// Further start values for the fit of an effect, besides those of its probe.
#pragma once

#include <vector>

#include "config/model.hpp"
#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/score/internal/candidates.hpp"

namespace shaker::estimator::diagnosis {

// Returns lines with the coefficient well inside of its range: at the start value of the catalogue,
// and halfway between its absent value and a near bound. Returns the probe's own line if the effect
// has no coefficient.
std::vector<config::EffectSpec> starts_of(const Probe& probe);

// For an effect without a coefficient, which is fully present from the start: lines with its first
// parameter much lower and much higher. Empty for other effects.
std::vector<config::EffectSpec> placed_apart(const Probe& probe);

// True if a fit of the effect went past where `line` starts it, to the end of a parameter's range:
// that start lies on the fit's way.
bool went_past(const HarmonicFit& fit, const config::EffectSpec& line);

}  // namespace shaker::estimator::diagnosis
