// Effects with a simpler effect as a special case: Stribeck friction without its static peak is dry
// friction. If the data do not exclude the special case, the simpler effect is the answer.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// Returns the special case of an effect, driven by the same input if there is one; empty if the
// catalogue has none.
std::string simpler_than(std::string_view effect);
// Returns the effects, sorted, with one of them replaced by its special case.
std::vector<std::string> simplified(std::vector<std::string> effects, const std::string& effect);
// True if the effect has a special case, and a parameter for each of its parameters.
bool holds_all_of_simpler(std::string_view effect);
// True if one of the two is a special case of the other, directly or through a third.
bool related(std::string_view a, std::string_view b);
// True if the parameters that make the effect richer are within two standard errors of the values
// (or at the bound) of the simpler effect.
bool reduces(const HarmonicFit& fit, std::string_view effect);

// Start values of a model that has one effect in the place of another, one of the two a special case
// of the other, at the parameters of `fit`: a richer effect starts as its special case.
std::vector<double> carried_across(const Model& model, std::string_view effect,
                                   const HarmonicFit& fit, std::string_view other);

}  // namespace shaker::estimator::diagnosis
