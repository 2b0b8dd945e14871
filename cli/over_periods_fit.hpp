// A fit where some run's response repeats only after several periods of the excitation.
#pragma once

#include <string>
#include <vector>

#include "cli/refined_fit.hpp"
#include "config/model.hpp"
#include "estimator/estimation.hpp"

namespace shaker::cli {

bool over_periods(const std::vector<estimator::RunData>& runs);

// A sentence where the model is linear at its starts and so has no such response; else empty.
std::string cannot_repeat_later(const estimator::Model& model,
                                const std::vector<estimator::RunData>& runs);

// From `start`; where that is no good, from what segments of the records lead to
// (estimator/time/over_periods.hpp). Leaves `fitted` at the better of the two. Throws as Estimator.
const estimator::Fit& fit_over_periods(RefinedFit& fitted, const estimator::Model& model,
                                       const std::vector<estimator::RunData>& runs,
                                       const std::vector<double>& start);

}  // namespace shaker::cli
