// Effects with a simpler effect as a special case: Stribeck friction without its static peak is dry
// friction. If the data do not exclude the special case, the simpler effect is the answer.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// Returns the special cases of an effect, driven by the same input if there is one.
std::vector<std::string> simpler_than(std::string_view effect);
// Returns the effects, sorted, with another in the place of one of them.
std::vector<std::string> with_instead(std::vector<std::string> effects, const std::string& effect,
                                      const std::string& other);
// True if the richer effect has a parameter for each of those of its special case.
bool holds_all_of(std::string_view richer, std::string_view simpler);
// True if one of the two is a special case of the other, directly or through a third.
bool related(std::string_view a, std::string_view b);
// True if the parameters that make the effect richer are within two standard errors of the values
// (or at the bound) of that simpler effect, or of any.
bool reduces(const HarmonicFit& fit, std::string_view effect, std::string_view simpler);
bool reduces(const HarmonicFit& fit, std::string_view effect);
// True if the fit stands at the values of the simpler effect.
bool is_special_case(const HarmonicFit& fit, std::string_view effect, std::string_view simpler);

// Start values of a model that has one effect in the place of another, one of the two a special case
// of the other, at the parameters of `fit`: a richer effect starts as its special case.
std::vector<double> carried_across(const Model& model, std::string_view effect,
                                   const HarmonicFit& fit, std::string_view other);

}  // namespace shaker::estimator::diagnosis
