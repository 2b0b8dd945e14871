// Levenberg-Marquardt: (J^T J + lambda I) p = J^T e (4.8). The parameters are scaled by the largest
// column norms of J so far (More 1978), so the units have no effect. The step is solved as the
// least-squares problem (4.9) by QR of [J; sqrt(lambda) D], which does not square the condition.
// lambda follows the ratio of actual to predicted decrease (Nielsen 1999). This is our own code: it
// keeps bounds by projection, refuses inadmissible steps, and tests convergence with the undamped
// step.
#include <algorithm>
#include <cmath>

#include <Eigen/QR>

#include "estimator/math/dense.hpp"
#include "estimator/paper/optimisers/internal/evaluator.hpp"
#include "estimator/paper/optimisers/methods.hpp"

namespace shaker::estimator::optimisers {
namespace {

constexpr double kFirstLambda = 1e-3;
constexpr double kLargestLambda = 1e20;

Eigen::VectorXd damped(const Eigen::MatrixXd& j, const Eigen::VectorXd& e,
                       const Eigen::VectorXd& scale, double lambda) {
  const Eigen::Index m = j.rows(), l = j.cols();
  Eigen::MatrixXd stacked(m + l, l);
  stacked.topRows(m) = j * scale.cwiseInverse().asDiagonal();
  stacked.bottomRows(l) = std::sqrt(lambda) * Eigen::MatrixXd::Identity(l, l);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(m + l);
  right.head(m) = e;
  return least_squares(stacked, right).cwiseQuotient(scale);
}

}  // namespace

Summary levenberg_marquardt(LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                            const Options& options) {
  constexpr const char* kName = "levenberg_marquardt";
  Evaluator evaluator(problem, options);
  Point point;
  point.theta = start;
  if (!evaluator.at(point, true)) return evaluator.finish(kName, Status::inadmissible, point);
  const int parameters = problem.parameters();
  Eigen::VectorXd norms = Eigen::VectorXd::Zero(parameters);
  double lambda = kFirstLambda, grow = 2.0;
  int& iteration = evaluator.summary().iterations;
  bool fresh = true;  // the point is new since the last test for convergence
  while (iteration < options.max_iterations && !evaluator.exhausted()) {
    const auto free = evaluator.free(point);
    if (free.empty()) return evaluator.finish(kName, Status::converged, point);
    const Eigen::MatrixXd j = columns(point.jacobian, free);
    if (fresh) {
      norms = norms.cwiseMax(point.jacobian.colwise().norm().transpose());
      const LinearStep linear = linear_step(j, point.e);
      const double left = relative(spread(linear.step, free, parameters), point.theta);
      if (linear.offset <= options.offset_tolerance || left <= options.step_tolerance)
        return evaluator.finish(kName, Status::converged, point);
      fresh = false;
    }
    const Eigen::VectorXd scale = lengths(norms, free);
    const Eigen::VectorXd step = spread(damped(j, point.e, scale, lambda), free, parameters);
    Point next;
    next.theta = point.theta + step;
    const bool admissible = evaluator.at(next, true);
    const Eigen::VectorXd taken = admissible ? (next.theta - point.theta).eval() : step;
    const double predicted = point.phi - 0.5 * (point.e - point.jacobian * taken).squaredNorm();
    const double ratio = admissible ? (point.phi - next.phi) / std::max(predicted, 1e-300) : -1.0;
    if (admissible && point.phi - next.phi > 0.0 && ratio > 1e-4) {
      point = std::move(next);
      const double cube = 2.0 * ratio - 1.0;
      lambda = std::max(lambda * std::max(1.0 / 3.0, 1.0 - cube * cube * cube), 1e-16);
      grow = 2.0;
      fresh = true;
      ++iteration;
      continue;
    }
    // The predicted decrease is below rounding: this is the minimum.
    if (admissible && std::fabs(predicted) <= kPhiRounding * point.phi)
      return evaluator.finish(kName, Status::converged, point);
    lambda *= grow;
    grow *= 2.0;
    if (lambda > kLargestLambda) return evaluator.finish(kName, Status::stalled, point);
  }
  return evaluator.finish(kName, Status::too_many, point);
}

}  // namespace shaker::estimator::optimisers
