// The residual of a fit and its gap, in the unit of the response.
#pragma once

#include <vector>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// A fit with the data that it was fitted to.
struct Fitted {
  const HarmonicFit& fit;
  const std::vector<RunDatum>& data;
};

// Residuals of the first `shown` of `given`, after subtraction of the expected errors of the time
// base and of the smoothing limit given the residual.
std::vector<Eigen::VectorXd> fit_residuals(const Fitted& fitted, const std::vector<RunDatum>& given,
                                           std::size_t shown);
// Root mean square over all runs.
double mean_square(const std::vector<Eigen::VectorXd>& left);

// The gap in the displacements (forces) of the fitted runs, divided by their noise floor.
double gap_over_floor(const Fitted& fitted, const std::vector<RunDatum>& given);

// The largest gap, in noise floors, that is called explained.
inline constexpr double kExplainedGap = 1.1;

}  // namespace shaker::estimator::diagnosis
