// The rest position of an added force. It is a constant of the effect's line; it is fitted and
// reported like a parameter.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/score/internal/candidates.hpp"
#include "estimator/diagnosis/select/internal/hypothesis.hpp"

namespace shaker::estimator::diagnosis {

// Indices of the added lines whose rest position is fitted.
std::vector<std::size_t> fitted_places(const config::ModelSpec& spec, std::size_t first_added);

// Number of constants that such places are worth. A spring that the motion never leaves at rest is a
// spring and a preload.
int count_of_places(const config::ModelSpec& spec, std::size_t first_added,
                    const MotionRange& motion);

// Returns a line of another effect with a place of rest whose force has the same first two derivatives
// over the stroke, in the middle of the motion, as that line of the fit. Empty if one of them has no place,
// or if the other cannot have that slope.
std::optional<config::EffectSpec> same_slope(const HarmonicFit& fit, std::size_t line,
                                             config::EffectSpec other, const MotionRange& motion);

// The rest positions with their standard errors, and how they move the parameters. A position that
// the data do not determine is left out.
std::vector<FittedConstant> places_of(const Hypothesis& h, const std::vector<RunDatum>& data,
                                      std::size_t first_added);

}  // namespace shaker::estimator::diagnosis
