// What the data say for a fit: of the runs that it was fitted to, and of each run under the fit of
// the others.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/fit/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// Log probability of the residuals (Student's t, as the standard errors are estimates) less the
// price of the parameters.
double log_evidence(const HarmonicFit& fit, const std::vector<RunDatum>& data, int added);
// Sum over runs of the log probability of each run under the fit of the others (linearised);
// nothing with fewer than two runs. The residuals of the runs left out, in standard errors, go to
// `left_out` unless it is null.
std::optional<double> cross_validate(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                     std::vector<Eigen::VectorXd>* left_out = nullptr);

}  // namespace shaker::estimator::diagnosis
