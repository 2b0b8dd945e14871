// Effects that a campaign cannot tell from one that was named.
#pragma once

#include <string>
#include <vector>

#include "estimator/diagnosis/select/selection.hpp"

namespace shaker::estimator::diagnosis {

// Effects that would do in the place of `effect` as well, as far as this campaign says; `best` is
// the answer, of `found.hypotheses`.
std::vector<std::string> indistinguishable_set(const std::string& effect, const Selection& found,
                                               const Hypothesis& best);

// Fits in which a rival stands in the place of `effect`; not those that are reduced to it, which
// no run tells apart.
std::vector<const HarmonicFit*> indistinguishable_fits(const std::string& effect,
                                                       const Selection& found,
                                                       const Hypothesis& best);

}  // namespace shaker::estimator::diagnosis
