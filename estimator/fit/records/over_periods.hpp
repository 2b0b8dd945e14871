// The fit of responses that repeat after several periods of the excitation, and its start.
//
// Such a response exists only in a narrow range of the parameters. Away from the true values a
// periodic fit converges to another response, or stops at the fold where its own response ends.
// Multiple shooting (transient.hpp) does not need an existing response: its segments start from the
// data for any parameters. Where their gaps close, the response exists.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "estimator/fit/estimation.hpp"
#include "estimator/fit/refined_fit.hpp"

namespace shaker::estimator {

// Fits the parameters to the runs' records, from `start` (all parameters). Estimator uses them as
// its own start. The result is empty if a run has Fourier coefficients instead of samples, or if
// the fit does not converge. Throws std::invalid_argument as TransientEstimator does.
std::optional<std::vector<double>> start_over_periods(const Model& model,
                                                      const std::vector<RunData>& runs,
                                                      const std::vector<double>& start);

// True when a run's response repeats only after several periods.
bool over_periods(const std::vector<RunData>& runs);

// Returns an error sentence when the model is linear at its start values, and therefore has no
// such response; otherwise empty.
std::string cannot_repeat_later(const Model& model, const std::vector<RunData>& runs);

// Fits from `start`. If that estimate is not usable or has a warning, fits also from a start
// by start_over_periods. Leaves
// `fitted` at the better of the two. Throws as Estimator does.
const Fit& fit_over_periods(RefinedFit& fitted, const Model& model,
                            const std::vector<RunData>& runs, const std::vector<double>& start);

}  // namespace shaker::estimator
