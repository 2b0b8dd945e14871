// The indistinguishable set: effects that the campaign cannot tell from a named one.
#pragma once

#include <string>
#include <vector>

#include "estimator/diagnosis/select/internal/weights.hpp"

namespace shaker::estimator::diagnosis {

// Returns the effects that could replace `effect` in this campaign. `best`: the answer among
// `found.hypotheses`.
std::vector<std::string> indistinguishable_set(const std::string& effect, const Selection& found,
                                               const Hypothesis& best, const Weights& weights);

// Returns the fits with another effect in the place of `effect`. Fits that have reduced to it are
// left out, since no run tells them apart.
std::vector<const HarmonicFit*> indistinguishable_fits(const std::string& effect,
                                                       const Selection& found,
                                                       const Hypothesis& best,
                                                       const Weights& weights);

}  // namespace shaker::estimator::diagnosis
