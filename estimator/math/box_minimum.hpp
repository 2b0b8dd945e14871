// Minimum of a convex quadratic function inside bounds (a box), as a bounded Gauss-Newton step
// needs it.
#pragma once

#include <Eigen/Dense>

namespace shaker::estimator {

// Vectors and matrices of at most `Most` variables, on the stack. Eigen::Dynamic: any number,
// on the heap.
template <int Most>
using BoxVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, Most, 1>;
template <int Most>
using BoxMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, Most, Most>;

// Minimises x'a x / 2 - b'x over lower <= x <= upper. `a` is positive definite, 0 is inside the
// box, and bounds may be infinite. Active-set method: from 0, x moves towards the minimum of
// the free variables until it meets a bound, which then holds its variable until the gradient
// there points inwards. The result is never worse than 0.
Eigen::VectorXd box_minimum(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                            const Eigen::VectorXd& lower, const Eigen::VectorXd& upper);

// The same into `x`; for Most = 8 it does not allocate. Instantiated for Most = 8 and
// Eigen::Dynamic. Returns false if the matrix of the free variables is nearly singular: a pivot
// is at or below `least_pivot` times its largest diagonal element.
template <int Most>
bool box_minimum(const BoxMatrix<Most>& a, const BoxVector<Most>& b, const BoxVector<Most>& lower,
                 const BoxVector<Most>& upper, double least_pivot, BoxVector<Most>& x);

}  // namespace shaker::estimator
