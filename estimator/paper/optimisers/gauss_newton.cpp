// Gauss-Newton by singular value decomposition: p = J^+ e (4.7). This is our own code: the
// available libraries have it only inside a trust region, but the tables of the paper use the pure
// method.
#include "estimator/paper/optimisers/internal/descent.hpp"
#include "estimator/paper/optimisers/methods.hpp"

namespace shaker::estimator::optimisers {
namespace {

bool pseudo_inverse(const Local& local, Eigen::VectorXd& step) {
  step = linear_step(local.jacobian, local.point.e).step;
  return true;
}

}  // namespace

Summary gauss_newton(LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                     const Options& options) {
  Evaluator evaluator(problem, options);
  return descend("gauss_newton", evaluator, start, StepRule::full, pseudo_inverse);
}

Summary gauss_newton_search(LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                            const Options& options) {
  Evaluator evaluator(problem, options);
  return descend("gauss_newton_search", evaluator, start, StepRule::length, pseudo_inverse);
}

Summary gauss_newton_relaxed(LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                             const Options& options) {
  Evaluator evaluator(problem, options);
  return descend("gauss_newton_relaxed", evaluator, start, StepRule::relaxation, pseudo_inverse);
}

}  // namespace shaker::estimator::optimisers
