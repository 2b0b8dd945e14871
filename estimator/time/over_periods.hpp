// A start for the fit of a response over several periods of the excitation.
//
// Such a response exists in a narrow range of the parameters only, and away from the truth a
// periodic fit ends on another one or on the fold where its own ends. Segments that begin in the
// data themselves (transient.hpp) need no response to be there: they follow the record from
// wherever the parameters start, and where their gaps close the response exists.
#pragma once

#include <optional>
#include <vector>

#include "estimator/estimation.hpp"

namespace shaker::estimator {

// Parameters of the motion through the runs' records, from `start` (all parameters); Estimator
// takes them for its own start. Empty where the runs have Fourier coefficients instead of samples,
// or the segments do not come to meet. Throws std::invalid_argument as TransientEstimator does.
std::optional<std::vector<double>> start_over_periods(const Model& model,
                                                      const std::vector<RunData>& runs,
                                                      const std::vector<double>& start);

}  // namespace shaker::estimator
