#include "estimator/paper/optimisers/internal/descent.hpp"

#include <algorithm>
#include <cmath>

namespace shaker::estimator::optimisers {
namespace {

constexpr double kSufficientDecrease = 1e-4;  // Armijo
constexpr double kShortest = 1e-12;           // share of the step at which a search fails
constexpr double kRounding = 1e-14;           // of phi: smaller differences are rounding

enum class Taken { yes, bottom, no };

// Line search along `step` from `from`; on `yes` the new point is in `to`.
Taken search(Evaluator& evaluator, const Point& from, const Eigen::VectorXd& step, Point& to) {
  const double slope = -(from.jacobian * step).dot(from.e);  // d phi / d alpha at 0
  if (!(slope < 0.0)) return Taken::no;
  // The predicted decrease is below rounding: this is the minimum.
  if (-slope <= kRounding * from.phi) return Taken::bottom;
  double alpha = 1.0;
  while (alpha > kShortest && !evaluator.exhausted()) {
    to.theta = from.theta + alpha * step;
    if (!evaluator.at(to, true)) {  // a periodic solution gives its Jacobian at no extra cost
      alpha *= 0.5;
      continue;
    }
    // Sufficient decrease (Armijo) for the step that the box leaves.
    const double along = -(from.jacobian * (to.theta - from.theta)).dot(from.e);
    if (along < 0.0 && to.phi <= from.phi + kSufficientDecrease * along) return Taken::yes;
    const double minimum = -0.5 * slope * alpha * alpha / (to.phi - from.phi - alpha * slope);
    alpha = std::clamp(minimum, 0.1 * alpha, 0.5 * alpha);
  }
  return Taken::no;
}

// Takes the whole share of the step; it is halved while inadmissible.
Taken go(Evaluator& evaluator, const Point& from, const Eigen::VectorXd& step, double share,
         Point& to) {
  for (; share > kShortest && !evaluator.exhausted(); share *= 0.5) {
    to.theta = from.theta + share * step;
    if (evaluator.at(to, true)) return Taken::yes;
  }
  return Taken::no;
}

}  // namespace

Summary descend(const char* method, Evaluator& evaluator, const Eigen::VectorXd& start,
                StepRule rule, const Direction& direction, int retries) {
  const Options& options = evaluator.options();
  Point point;
  point.theta = start;
  if (!evaluator.at(point, true)) return evaluator.finish(method, Status::inadmissible, point);
  double progress = 1.0;
  int failures = 0;  // at this point
  int& iteration = evaluator.summary().iterations;
  while (iteration < options.max_iterations && !evaluator.exhausted()) {
    const auto free = evaluator.free(point);
    if (free.empty()) return evaluator.finish(method, Status::converged, point);
    const Local local{point, free, columns(point.jacobian, free), progress};
    const LinearStep linear = linear_step(local.jacobian, point.e);
    if (linear.offset <= options.offset_tolerance && iteration > 0)
      return evaluator.finish(method, Status::converged, point);
    Eigen::VectorXd step;
    if (!direction(local, step) || !step.allFinite())
      return evaluator.finish(method, Status::stalled, point);
    const Eigen::VectorXd whole =
        evaluator.along_box(point, spread(step, free, evaluator.problem().parameters()));
    const double length = relative(whole, point.theta);
    Point next;
    Taken taken = Taken::no;
    double share = 1.0;
    if (rule == StepRule::length) {
      if (length <= options.step_tolerance)
        return evaluator.finish(method, Status::converged, point);
      taken = search(evaluator, point, whole, next);
    } else {
      const bool relaxed = rule == StepRule::relaxation && iteration < options.relaxed_iterations;
      share = relaxed ? options.relaxation : 1.0;
      taken = go(evaluator, point, whole, share, next);
    }
    if (taken == Taken::bottom) return evaluator.finish(method, Status::converged, point);
    if (taken == Taken::no) {
      const bool bottom = length <= std::sqrt(options.step_tolerance) &&
                          linear.offset <= std::sqrt(options.offset_tolerance);
      if (!bottom && failures++ < retries) {
        progress = 0.0;
        continue;
      }
      return evaluator.finish(method, bottom ? Status::converged : Status::stalled, point);
    }
    ++iteration;
    failures = 0;
    progress = (point.phi - next.phi) / std::max(point.phi, 1e-300);
    std::swap(point, next);
    if (length <= options.step_tolerance && share == 1.0)
      return evaluator.finish(method, Status::converged, point);
  }
  return evaluator.finish(method, Status::too_many, point);
}

}  // namespace shaker::estimator::optimisers
