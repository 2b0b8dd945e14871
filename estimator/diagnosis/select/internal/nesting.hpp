// Effects with a simpler effect as a special case: Stribeck friction without its static peak is dry
// friction. If the data do not exclude the special case, the simpler effect is the answer.
#pragma once

#include <string>
#include <string_view>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// Returns the special case of an effect, driven by the same input if there is one; empty if the
// catalogue has none.
std::string simpler_than(std::string_view effect);
// True if one of the two is a special case of the other, directly or through a third.
bool related(std::string_view a, std::string_view b);
// True if the parameters that make the effect richer are within two standard errors of the values
// (or at the bound) of the simpler effect.
bool reduces(const HarmonicFit& fit, std::string_view effect);

}  // namespace shaker::estimator::diagnosis
