// The evidence for a fit: from the runs that it was fitted to, and from each run under the fit of
// the others.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// Log probability of the residuals, less half a log(n) for each of the `added` parameters. It is
// that of Student's t, because the standard errors are estimates.
double log_evidence(const HarmonicFit& fit, const std::vector<RunDatum>& data, int added);
// A run under the (linearised) fit of the others.
struct LeftOutRun {
  Eigen::VectorXd residual;  // in standard errors
  // Its covariance where nothing but noise is left: the identity plus uncertain * uncertain'.
  Eigen::MatrixXd uncertain;
};
// Sum over the runs of the log probability of each run under the (linearised) fit of the others.
// Empty for fewer than two runs. If `left_out` is not null, it receives each run of `data`.
std::optional<double> cross_validate(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                     std::vector<LeftOutRun>* left_out = nullptr);

}  // namespace shaker::estimator::diagnosis
