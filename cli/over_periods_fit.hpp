// Fits runs of which at least one repeats only after several periods of the excitation.
#pragma once

#include <string>
#include <vector>

#include "cli/refined_fit.hpp"
#include "config/model.hpp"
#include "estimator/fit/estimation.hpp"

namespace shaker::cli {

// True when a run's response repeats only after several periods.
bool over_periods(const std::vector<estimator::RunData>& runs);

// Returns an error sentence when the model is linear at its start values, and therefore has no
// such response; otherwise empty.
std::string cannot_repeat_later(const estimator::Model& model,
                                const std::vector<estimator::RunData>& runs);

// Fits from `start`. If that estimate is not usable or has a warning, fits also from a start
// that is computed from segments of the records (estimator/time/over_periods.hpp). Leaves
// `fitted` at the better of the two. Throws as Estimator does.
const estimator::Fit& fit_over_periods(RefinedFit& fitted, const estimator::Model& model,
                                       const std::vector<estimator::RunData>& runs,
                                       const std::vector<double>& start);

}  // namespace shaker::cli
