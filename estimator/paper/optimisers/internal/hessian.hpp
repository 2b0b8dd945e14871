// Second-order functions of Newton and modified Gauss-Newton. Internal to the folder.
#pragma once

#include "estimator/paper/optimisers/internal/descent.hpp"

namespace shaker::estimator::optimisers {

Eigen::MatrixXd rows_and_columns(const Eigen::MatrixXd& matrix, const std::vector<int>& free);

// H^-1 right, with H scaled to unit diagonal and its eigenvalues replaced by their moduli. This is
// a descent direction even where H is indefinite.
Eigen::VectorXd downhill_solve(const Eigen::MatrixXd& h, const Eigen::VectorXd& right);
// The same without scaling. Directions whose |eigenvalue| is not above `floor` are left out.
Eigen::VectorXd downhill_solve_above(const Eigen::MatrixXd& h, const Eigen::VectorXd& right,
                                     double floor);

// Q times a direction over the free parameters, from differences of the gradient along it:
// Q v = dq/dv - J^T J v. Central with two Jacobians, one-sided if one side is inadmissible. Returns
// false when both sides are, or the direction is zero.
bool curvature_along(Evaluator& evaluator, const Local& local, const Eigen::VectorXd& direction,
                     Eigen::VectorXd& out);

}  // namespace shaker::estimator::optimisers
