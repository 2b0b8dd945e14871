// The estimates of a fit, for the report and for the model file.
#pragma once

#include <vector>

#include "config/model.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/fit/estimate.hpp"

namespace shaker::estimator::diagnosis {

// Returns every parameter with its standard error and 95 % interval, and the constants that were
// fitted with them: that of the fit, and the rest positions in `places`.
std::vector<ParameterEstimate> describe(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                        const std::vector<FittedConstant>& places = {});

// The model file that starts at the estimates. A parameter with a value per run or group has each of
// them, and starts at their mean.
config::ModelSpec at_estimates(const HarmonicFit& fit);
// The damper of one more run: such a parameter is one number.
config::ModelSpec with_mean_values(config::ModelSpec spec);

// Warns of each that ended at an end of its range, which may be what keeps the gap open. A coefficient that
// ends at zero is absent.
void warn_of_bounds(Diagnosis& said);

}  // namespace shaker::estimator::diagnosis
