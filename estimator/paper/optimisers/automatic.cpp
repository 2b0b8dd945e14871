// The default method, for callers that do not choose one.
//
// Levenberg-Marquardt runs first; it nearly always succeeds. If it does not converge, or ends where
// the Jacobian is rank deficient (the plateaus of exponentials), variable projection, modified
// Gauss-Newton (large residuals), Newton and the trust region follow, from the start and from its
// end. The smallest phi wins. The result is polished in 34 digits if the problem supports this.
#include <algorithm>
#include <array>

#include "estimator/paper/optimisers/internal/evaluator.hpp"
#include "estimator/paper/optimisers/internal/extended.hpp"
#include "estimator/paper/optimisers/methods.hpp"

namespace shaker::estimator::optimisers {
namespace {

constexpr double kNoEffect = 1e-8;

void add_counts(Summary& to, const Summary& from) {
  to.iterations += from.iterations;
  to.evaluations += from.evaluations;
  to.jacobians += from.jacobians;
  to.curvatures += from.curvatures;
  to.refused += from.refused;
}

bool better(const Summary& a, const Summary& b) {
  if (b.status == Status::inadmissible) return a.status != Status::inadmissible;
  if (a.status == Status::inadmissible) return false;
  const double margin = 1e-9 * b.sum_of_squares;
  if (a.sum_of_squares < b.sum_of_squares - margin) return true;
  return a.status == Status::converged && b.status != Status::converged &&
         a.sum_of_squares <= b.sum_of_squares + margin;
}

// Tests if the free parameters have full rank. The bounds determine the others.
bool full_rank(LeastSquaresProblem& problem, const Summary& summary) {
  Evaluator evaluator(problem, {});
  Point point;
  point.theta = summary.theta;
  if (!evaluator.at(point, true)) return false;
  const auto free = evaluator.free(point);
  const Eigen::MatrixXd j = columns(point.jacobian, free);
  // The effect on yhat of a parameter's relative change; on a plateau it is close to zero.
  const Eigen::VectorXd effect =
      point.jacobian.colwise().norm().transpose().cwiseProduct(point.theta.cwiseAbs());
  for (const int k : free) {
    if (!(effect[k] > kNoEffect * effect.maxCoeff())) return false;
  }
  return linear_step(j, point.e).rank == static_cast<int>(free.size());
}

void polish_in_extended(LeastSquaresProblem& problem, Summary& best) {
  const ExtendedProblem* extended = problem.extended();
  if (extended == nullptr || best.status == Status::inadmissible) return;
  const Polished polished =
      polish(*extended, {best.theta.data(), best.theta.data() + best.theta.size()});
  if (!polished.converged || polished.sum_of_squares > best.sum_of_squares * (1.0 + 1e-6)) return;
  best.theta = Eigen::Map<const Eigen::VectorXd>(polished.theta.data(), best.theta.size());
  best.sum_of_squares = polished.sum_of_squares;
  best.status = Status::converged;
}

}  // namespace

Summary automatic(LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                  const Options& options) {
  Summary counts;
  Summary best = levenberg_marquardt(problem, start, options);
  add_counts(counts, best);
  const auto settled = [&](const Summary& s) {
    return s.status == Status::converged && full_rank(problem, s);
  };
  constexpr std::array<Minimise, 4> kHelpers = {variable_projection, modified_gauss_newton, newton,
                                                trust_region};
  const Eigen::VectorXd end = best.theta;
  for (const Eigen::VectorXd& from : {start, end}) {
    for (const Minimise helper : kHelpers) {
      if (best.status == Status::inadmissible || settled(best)) break;
      const Summary found = helper(problem, from, options);
      add_counts(counts, found);
      if (better(found, best) || (settled(found) && !settled(best) &&
                                  found.sum_of_squares <= best.sum_of_squares * (1.0 + 1e-6)))
        best = found;
    }
  }
  polish_in_extended(problem, best);
  best.method = "automatic";
  best.iterations = counts.iterations;
  best.evaluations = counts.evaluations;
  best.jacobians = counts.jacobians;
  best.curvatures = counts.curvatures;
  best.refused = counts.refused;
  return best;
}

}  // namespace shaker::estimator::optimisers
