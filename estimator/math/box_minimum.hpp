// The minimum of a convex quadratic inside a box, as a Gauss-Newton step within bounds is.
#pragma once

#include <Eigen/Dense>

namespace shaker::estimator {

// Vectors and matrices of at most so many variables that live on the stack; Eigen::Dynamic: any
// number, on the heap.
template <int Most>
using BoxVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, Most, 1>;
template <int Most>
using BoxMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, Most, Most>;

// Minimises x'a x / 2 - b'x over lower <= x <= upper, a positive definite and 0 inside the box, by
// an active set: from 0 towards the minimum of the free ones as far as the first bound, which then
// holds its variable until the slope there points inwards. Bounds may be infinite. Never worse
// than 0.
Eigen::VectorXd box_minimum(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                            const Eigen::VectorXd& lower, const Eigen::VectorXd& upper);

// The same into `x`, allocating nothing where Most is a number; of Most there are 8 and
// Eigen::Dynamic. False where the free ones do not determine each other: a pivot is at or below
// `least_pivot` of the largest diagonal.
template <int Most>
bool box_minimum(const BoxMatrix<Most>& a, const BoxVector<Most>& b, const BoxVector<Most>& lower,
                 const BoxVector<Most>& upper, double least_pivot, BoxVector<Most>& x);

}  // namespace shaker::estimator
