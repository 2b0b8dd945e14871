// Trust region (4.9) with Powell's dogleg: the farthest point within |D p| <= Delta on the path
// from the steepest-descent step to the Gauss-Newton step. D holds the largest column norms of J so
// far. This is our own code because Ceres' dogleg stops short of minima on a bound.
#include <algorithm>
#include <cmath>

#include "estimator/paper/optimisers/internal/evaluator.hpp"
#include "estimator/paper/optimisers/methods.hpp"

namespace shaker::estimator::optimisers {
namespace {

constexpr double kSmallest = 1e-14;  // of |D theta|

// Computes the step D p in scaled parameters; j = J D^-1.
Eigen::VectorXd dogleg(const Eigen::MatrixXd& j, const Eigen::VectorXd& e,
                       const Eigen::VectorXd& newton, double delta) {
  if (newton.norm() <= delta) return newton;
  const Eigen::VectorXd downhill = j.transpose() * e;
  const double curvature = (j * downhill).squaredNorm();
  if (!(curvature > 0.0)) return delta / newton.norm() * newton;
  const Eigen::VectorXd cauchy = downhill.squaredNorm() / curvature * downhill;
  if (cauchy.norm() >= delta) return delta / downhill.norm() * downhill;
  const Eigen::VectorXd rest = newton - cauchy;
  const double a = rest.squaredNorm(), b = cauchy.dot(rest);
  const double c = cauchy.squaredNorm() - delta * delta;
  return cauchy + (-b + std::sqrt(std::max(b * b - a * c, 0.0))) / a * rest;
}

}  // namespace

Summary trust_region(LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                     const Options& options) {
  constexpr const char* kName = "trust_region";
  Evaluator evaluator(problem, options);
  Point point;
  point.theta = start;
  if (!evaluator.at(point, true)) return evaluator.finish(kName, Status::inadmissible, point);
  const int parameters = problem.parameters();
  Eigen::VectorXd norms = Eigen::VectorXd::Zero(parameters);
  double delta = -1.0;
  int& iteration = evaluator.summary().iterations;
  while (iteration < options.max_iterations && !evaluator.exhausted()) {
    const auto free = evaluator.free(point);
    if (free.empty()) return evaluator.finish(kName, Status::converged, point);
    norms = norms.cwiseMax(point.jacobian.colwise().norm().transpose());
    const Eigen::VectorXd scale = lengths(norms, free);
    double size = 0.0;
    for (std::size_t k = 0; k < free.size(); ++k)
      size = std::hypot(size, scale[static_cast<Eigen::Index>(k)] * point.theta[free[k]]);
    if (delta < 0.0) delta = std::max(size, 1e-3 * point.e.norm());
    const Eigen::MatrixXd j = columns(point.jacobian, free);
    const LinearStep linear = linear_step(j, point.e);
    if (linear.offset <= options.offset_tolerance ||
        relative(spread(linear.step, free, parameters), point.theta) <= options.step_tolerance)
      return evaluator.finish(kName, Status::converged, point);
    const Eigen::VectorXd scaled = dogleg(j * scale.cwiseInverse().asDiagonal(), point.e,
                                          scale.asDiagonal() * linear.step, delta);
    const Eigen::VectorXd step =
        evaluator.along_box(point, spread(scaled.cwiseQuotient(scale), free, parameters));
    Point next;
    next.theta = point.theta + step;
    const bool admissible = evaluator.at(next, true);
    const Eigen::VectorXd taken = admissible ? (next.theta - point.theta).eval() : step;
    const double predicted = point.phi - 0.5 * (point.e - point.jacobian * taken).squaredNorm();
    const double ratio = admissible ? (point.phi - next.phi) / std::max(predicted, 1e-300) : -1.0;
    if (admissible && std::fabs(predicted) <= kPhiRounding * point.phi)
      return evaluator.finish(kName, Status::converged, next.phi < point.phi ? next : point);
    if (ratio < 0.25) delta = 0.25 * std::min(delta, scaled.norm());
    if (ratio > 0.75) delta = std::max(delta, 3.0 * scaled.norm());
    if (ratio > 1e-4 && next.phi < point.phi) {
      point = std::move(next);
      ++iteration;
    } else if (delta <= kSmallest * std::max(size, 1e-300)) {
      return evaluator.finish(kName, Status::stalled, point);
    }
  }
  return evaluator.finish(kName, Status::too_many, point);
}

}  // namespace shaker::estimator::optimisers
