// Where even the best model leaves far more than noise, the noise says little of what matters: the
// last harmonic, known to a micrometre, would bend the parameters as much as the first. Real
// dampers are so. Then the search is done once more with errors that hold what the best hypothesis
// leaves, spread evenly over a run: every share of the gap counts alike, and effects are named in
// the order in which they close it. That something is left stays said.
#pragma once

#include <optional>
#include <vector>

#include "estimator/diagnosis/select/selection.hpp"

namespace shaker::estimator::diagnosis {

// The data with such errors; nothing when the first search was content, or what is left is near the
// noise, or next to nothing beside what the base model leaves.
std::optional<std::vector<RunDatum>> with_model_error(const Selection& found,
                                                      const std::vector<RunDatum>& data);

}  // namespace shaker::estimator::diagnosis
