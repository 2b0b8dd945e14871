// A start for the fit of a response that repeats after several periods of the excitation.
//
// Such a response exists only in a narrow range of the parameters. Away from the true values a
// periodic fit converges to another response, or stops at the fold where its own response ends.
// Multiple shooting (transient.hpp) does not need an existing response: its segments start from the
// data for any parameters. Where their gaps close, the response exists.
#pragma once

#include <optional>
#include <vector>

#include "estimator/fit/estimation.hpp"

namespace shaker::estimator {

// Fits the parameters to the runs' records, from `start` (all parameters). Estimator uses them as
// its own start. The result is empty if a run has Fourier coefficients instead of samples, or if
// the fit does not converge. Throws std::invalid_argument as TransientEstimator does.
std::optional<std::vector<double>> start_over_periods(const Model& model,
                                                      const std::vector<RunData>& runs,
                                                      const std::vector<double>& start);

}  // namespace shaker::estimator
