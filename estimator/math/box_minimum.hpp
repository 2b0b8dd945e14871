// The minimum of a convex quadratic inside a box, as a Gauss-Newton step within bounds is.
#pragma once

#include <Eigen/Dense>

namespace shaker::estimator {

// Minimises x'a x / 2 - b'x over lower <= x <= upper, a positive definite and 0 inside the box, by
// an active set: from 0 towards the minimum of the free ones as far as the first bound, which then
// holds its variable until the slope there points inwards. Bounds may be infinite. Never worse
// than 0.
Eigen::VectorXd box_minimum(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                            const Eigen::VectorXd& lower, const Eigen::VectorXd& upper);

}  // namespace shaker::estimator
