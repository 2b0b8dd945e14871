// A fit's estimates, to be told and to be kept.
#pragma once

#include <vector>

#include "config/model.hpp"
#include "estimator/diagnosis/fit/harmonic_fit.hpp"
#include "estimator/estimate.hpp"

namespace shaker::estimator::diagnosis {

// Every parameter with its standard error and 95 % interval, and the constants that were fitted
// beside them: that of the fit, and `places` of rest.
std::vector<ParameterEstimate> describe(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                        const std::vector<FittedConstant>& places = {});

// The model file that starts at the estimates.
config::ModelSpec at_estimates(const HarmonicFit& fit);

}  // namespace shaker::estimator::diagnosis
