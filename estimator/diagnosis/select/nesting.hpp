// Effects that hold a simpler one as a special case: Stribeck friction without its static peak is
// dry friction. Where the data do not exclude the special case, the simpler effect is the answer.
#pragma once

#include <string>
#include <string_view>

#include "estimator/diagnosis/fit/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// Empty: it holds none of the catalogue.
std::string_view simpler_than(std::string_view effect);
// One holds the other, directly or not.
bool related(std::string_view a, std::string_view b);
// The parameters that make the effect richer are, in this fit, within two standard errors of the
// values (or at the bound) at which it is the simpler one.
bool reduces(const HarmonicFit& fit, std::string_view effect);

}  // namespace shaker::estimator::diagnosis
