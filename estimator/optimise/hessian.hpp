// Second-order pieces that Newton and modified Gauss-Newton share. Internal to the folder.
#pragma once

#include "estimator/optimise/descent.hpp"

namespace shaker::estimator::optimise {

Eigen::MatrixXd rows_and_columns(const Eigen::MatrixXd& matrix, const std::vector<int>& free);

// H^-1 right, with the eigenvalues of H (at unit diagonal) made positive: a descent direction even
// where H is indefinite.
Eigen::VectorXd downhill_solve(const Eigen::MatrixXd& h, const Eigen::VectorXd& right);
// The same as h stands; directions with eigenvalues not above `floor` are left alone.
Eigen::VectorXd downhill_solve_above(const Eigen::MatrixXd& h, const Eigen::VectorXd& right,
                                     double floor);

// Q times a direction over the free parameters, from central differences of the gradient along it:
// Q v = d(q)/dv - J^T J v. Two Jacobians. False when both sides are inadmissible.
bool curvature_along(Evaluator& evaluator, const Local& local, const Eigen::VectorXd& direction,
                     Eigen::VectorXd& out);

}  // namespace shaker::estimator::optimise
