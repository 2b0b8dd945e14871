// Friction that turns round over a width that nobody stated: the width fitted beside the
// parameters.
//
// A seal turns its friction round as gently as it pleases: neither a jump nor the catalogue's own
// width leaves but noise then, and what they leave looks like one more effect. Gauss-Newton: the
// slope over the width is a difference of two predictions, the parameters are fitted in full at
// each width, on a grid whose steps resolve it.
#pragma once

#include <memory>
#include <vector>

#include "estimator/diagnosis/fit/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// From `near`, whose friction is as wide as its spec states it, or of no width at all (`sharp`).
// The fit states the width in its spec, and in `constant` with its error. Null where the model has
// no friction, or more than one, where the slope over the width says that more than a quarter of
// chi-squared, and more than `most`, would be left, and where no width leaves as little as `most`.
// Of periodic runs. `options`: points are those of the coarsest grid.
std::shared_ptr<const HarmonicFit> with_fitted_width(const HarmonicFit& near, bool sharp,
                                                     const std::vector<RunDatum>& data,
                                                     const FitOptions& options, double most);

}  // namespace shaker::estimator::diagnosis
