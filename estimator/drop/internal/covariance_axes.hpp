// The principal axes of a hypothesis' covariance.
#pragma once

#include <vector>

#include "estimator/model/identified_damper.hpp"

namespace shaker::estimator {

// Steps of DamperHypothesis::numbers, a standard deviation along each axis; in units of the standard
// errors so that no unit counts. `half_range`: half of the distance of each number's bounds; infinite
// where it has none. None where the covariance does not fit the numbers.
std::vector<std::vector<double>> covariance_axes(const DamperHypothesis& damper,
                                                 const std::vector<double>& half_range);

}  // namespace shaker::estimator
