// How the force of a damper moves with its uncertain numbers.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "estimator/model/identified_damper.hpp"

namespace shaker::estimator {

// Derivatives of the force over DamperHypothesis::numbers, a column each, at the strokes and
// velocities of `points`. Internal coordinates are at rest. A constant's column is 0. Nothing for a
// damper of several masses, and where a point is inadmissible.
std::optional<Eigen::MatrixXd> force_slopes(const DamperHypothesis& damper,
                                            const std::vector<VisitedCell>& points);

}  // namespace shaker::estimator
