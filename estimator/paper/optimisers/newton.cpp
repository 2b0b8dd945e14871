// Newton's method for phi: (J^T J + Q) p = J^T e (4.5), with Q exact or from differences of the
// gradient. Where the Hessian is not positive definite, its eigenvalues are replaced by their
// moduli, so that the step is a descent direction. This is our own code because none of the
// available libraries uses second derivatives.
#include <algorithm>
#include <cmath>

#include "estimator/paper/optimisers/internal/descent.hpp"
#include "estimator/paper/optimisers/internal/hessian.hpp"
#include "estimator/paper/optimisers/methods.hpp"

namespace shaker::estimator::optimisers {

Summary newton(LeastSquaresProblem& problem, const Eigen::VectorXd& start, const Options& options) {
  Evaluator evaluator(problem, options);
  if (!problem.has_curvature()) return newton_differences(problem, start, options);
  return descend("newton", evaluator, start, StepRule::length,
                 [&](const Local& local, Eigen::VectorXd& step) {
                   Eigen::MatrixXd q;
                   if (!evaluator.curvature(local.point.theta, q)) return false;
                   Eigen::MatrixXd h = local.jacobian.transpose() * local.jacobian;
                   h += rows_and_columns(q, local.free);
                   step = downhill_solve(h, local.jacobian.transpose() * local.point.e);
                   return true;
                 });
}

Summary newton_differences(LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                           const Options& options) {
  Evaluator evaluator(problem, options);
  return descend("newton_differences", evaluator, start, StepRule::length,
                 [&](const Local& local, Eigen::VectorXd& step) {
                   const auto n = static_cast<Eigen::Index>(local.free.size());
                   Eigen::MatrixXd h = local.jacobian.transpose() * local.jacobian;
                   Eigen::MatrixXd q(n, n);
                   for (Eigen::Index k = 0; k < n; ++k) {
                     Eigen::VectorXd column;
                     if (!curvature_along(evaluator, local, Eigen::VectorXd::Unit(n, k), column))
                       return false;
                     q.col(k) = column;
                   }
                   h += 0.5 * (q + q.transpose());
                   step = downhill_solve(h, local.jacobian.transpose() * local.point.e);
                   return true;
                 });
}

}  // namespace shaker::estimator::optimisers
