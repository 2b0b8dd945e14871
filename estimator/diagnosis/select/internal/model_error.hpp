// Selection where even the best hypothesis leaves far more than noise, as with real dampers. Errors
// from noise are then misleading: the last harmonic, known to a micrometre, would bend the
// parameters as much as the first. The search is repeated with errors that include the residual of
// the best hypothesis, spread evenly over each run. Every share of the gap then counts alike, and
// effects are named in the order in which they close it. The verdict stays `unexplained`.
#pragma once

#include <optional>
#include <vector>

#include "estimator/diagnosis/select/internal/selection.hpp"

namespace shaker::estimator::diagnosis {

// Returns the data with such errors. Empty if the first search explained the data, if the residual
// is near the noise, or if it is negligible beside the residual of the base model.
std::optional<std::vector<RunDatum>> with_model_error(const Selection& found,
                                                      const std::vector<RunDatum>& data);

}  // namespace shaker::estimator::diagnosis
