// What a fit leaves of the measured responses: the gap, in their own unit.
#pragma once

#include <vector>

#include "estimator/diagnosis/fit/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// A fit with the data that it was fitted to.
struct Fitted {
  const HarmonicFit& fit;
  const std::vector<RunDatum>& data;
};

// Of the first `shown` of the data as they were given, less what the time base and the grid's limit
// leave open: the noise that one expects given the residual.
std::vector<Eigen::VectorXd> fit_residuals(const Fitted& fitted, const std::vector<RunDatum>& given,
                                           std::size_t shown);
// Root mean square of what is left of runs.
double mean_square(const std::vector<Eigen::VectorXd>& left);

// The gap that the fit leaves in the displacements (forces) of the runs that were fitted, over
// their noise floor.
double gap_over_floor(const Fitted& fitted, const std::vector<RunDatum>& given);

// A gap of more than so many floors is not called explained.
inline constexpr double kExplainedGap = 1.1;

}  // namespace shaker::estimator::diagnosis
