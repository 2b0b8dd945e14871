// Fits the smoothing width of a friction beside the parameters.
//
// A seal reverses its friction over any width. Neither zero width nor the width of the catalogue
// then leaves only noise, and the rest looks like one more effect. The width is found by
// Gauss-Newton steps: its derivative is a difference of two predictions, and at each width all
// parameters are fitted on a grid that resolves it.
#pragma once

#include <memory>
#include <vector>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// Starts from `near`: a fit of zero width (`sharp`), or of the width that its model states. The
// result states the width in its model, and in `constant` with its standard error. A friction and
// what a further input drives of it reverse over one width. Null if the model does not have exactly
// one friction without memory, or if no width leaves less than `most`. Where the derivative promises that
// more than a quarter of chi-squared and more than `most` would remain, two wide widths are tried.
// `options.points`: those of the coarsest grid.
std::shared_ptr<const HarmonicFit> with_fitted_width(const HarmonicFit& near, bool sharp,
                                                     const std::vector<RunDatum>& data,
                                                     const FitOptions& options, double most);

}  // namespace shaker::estimator::diagnosis
