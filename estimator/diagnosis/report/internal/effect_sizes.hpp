// How much of the response an added effect makes.
#pragma once

#include <string>
#include <vector>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// Root mean square of what the effect changes of the response at the estimates of `fit`, to first
// order, after the first `base` lines of the model have mimicked what their parameters can. Of an
// effect without a coefficient, what as much of its first parameter as it has changes. `data`: those
// of the fit. In the unit of the response.
double size_of(const HarmonicFit& fit, const std::vector<RunDatum>& data, std::size_t base,
               const std::string& effect);

}  // namespace shaker::estimator::diagnosis
