#include "estimator/paper/optimisers/internal/scaled.hpp"

#include <cmath>

namespace shaker::estimator::optimisers {
namespace {

constexpr double kFlatCosine = 1e-6;  // largest cosine of residuals and columns of J at a minimum

}  // namespace

Summary judge(const char* method, Scaled& scaled, bool gave_up) {
  Evaluator& evaluator = scaled.evaluator();
  const Options& options = evaluator.options();
  Point point = scaled.best();
  const Summary before = evaluator.summary();
  Status status = gave_up || evaluator.exhausted() ? Status::too_many : Status::stalled;
  if (evaluator.at(point, true)) {
    const auto free = evaluator.free(point);
    const LinearStep linear = linear_step(columns(point.jacobian, free), point.e);
    const Eigen::VectorXd left = spread(linear.step, free, evaluator.problem().parameters());
    const Eigen::VectorXd norms = columns(point.jacobian, free).colwise().norm() * point.e.norm();
    const Eigen::VectorXd slope = columns(point.jacobian, free).transpose() * point.e;
    const bool flat = (slope.cwiseAbs().array() <= kFlatCosine * norms.array()).all();
    if (flat || linear.offset <= std::sqrt(options.offset_tolerance) ||
        relative(left, point.theta) <= std::sqrt(options.step_tolerance))
      status = Status::converged;
  }
  evaluator.summary() = before;  // this evaluation is not counted
  return evaluator.finish(method, status, point);
}

}  // namespace shaker::estimator::optimisers
