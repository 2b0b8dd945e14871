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

// Minimises x'a x / 2 - b'x over lower <= x <= upper, into `x`. `a` is positive definite, 0 is inside
// the box, and bounds may be infinite. Active-set method: from 0, x moves towards the minimum of the
// free variables until it meets a bound, which then holds its variable until the gradient there
// points inwards. The result is never worse than 0. Returns false if the matrix of the free
// variables is nearly singular: a pivot is at or below `least_pivot` times its largest diagonal
// element. Instantiated for Most = 8, which does not allocate, and Eigen::Dynamic; below as well.
template <int Most>
bool box_minimum(const BoxMatrix<Most>& a, const BoxVector<Most>& b, const BoxVector<Most>& lower,
                 const BoxVector<Most>& upper, double least_pivot, BoxVector<Most>& x);

// The damped step of least squares inside its bounds: the same of gram + damping diag(gram) and
// gradient, with the variables scaled to a unit diagonal. A variable at a bound has exactly its
// value.
template <int Most>
bool damped_box_step(const BoxMatrix<Most>& gram, const BoxVector<Most>& gradient,
                     const BoxVector<Most>& lower, const BoxVector<Most>& upper, double damping,
                     double least_pivot, BoxVector<Most>& x);
// The step, however singular the matrix is.
Eigen::VectorXd damped_box_step(const Eigen::MatrixXd& gram, const Eigen::VectorXd& gradient,
                                const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                                double damping);

}  // namespace shaker::estimator
