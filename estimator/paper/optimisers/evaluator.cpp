#include "estimator/paper/optimisers/internal/evaluator.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/SVD>
#include <fmt/format.h>

#include "estimator/math/dense.hpp"

namespace shaker::estimator::optimisers {

Evaluator::Evaluator(LeastSquaresProblem& problem, const Options& options)
    : problem_(problem), options_(options), lower_(problem.lower()), upper_(problem.upper()) {
  for (Eigen::Index k = 0; k < lower_.size(); ++k) {
    if (!(lower_[k] <= upper_[k]))
      throw std::invalid_argument(
          fmt::format("parameter {}: the lower bound {:g} is above the upper bound {:g}", k + 1,
                      lower_[k], upper_[k]));
  }
}

Eigen::VectorXd Evaluator::into_box(const Eigen::VectorXd& theta) const {
  return theta.cwiseMax(lower_).cwiseMin(upper_);
}

Eigen::VectorXd Evaluator::along_box(const Point& point, Eigen::VectorXd step) const {
  for (Eigen::Index k = 0; k < step.size(); ++k) {
    if ((point.theta[k] <= lower_[k] && step[k] < 0.0) ||
        (point.theta[k] >= upper_[k] && step[k] > 0.0))
      step[k] = 0.0;
  }
  return step;
}

bool Evaluator::at(Point& point, bool with_jacobian) {
  point.theta = into_box(point.theta);
  ++summary_.evaluations;
  if (with_jacobian) ++summary_.jacobians;
  const bool good =
      point.theta.allFinite() &&
      problem_.evaluate(point.theta, point.e, with_jacobian ? &point.jacobian : nullptr) &&
      point.e.allFinite() && (!with_jacobian || point.jacobian.allFinite());
  if (!good) {
    ++summary_.refused;
    return false;
  }
  point.phi = 0.5 * point.e.squaredNorm();
  if (std::isfinite(point.phi)) return true;
  ++summary_.refused;
  return false;
}

bool Evaluator::curvature(const Eigen::VectorXd& theta, Eigen::MatrixXd& q) {
  ++summary_.curvatures;
  return problem_.curvature(theta, q) && q.allFinite();
}

std::vector<int> Evaluator::free(const Point& point) const {
  const Eigen::VectorXd downhill = point.jacobian.transpose() * point.e;  // -q
  std::vector<int> list;
  for (int k = 0; k < problem_.parameters(); ++k) {
    const bool held = (point.theta[k] <= lower_[k] && downhill[k] <= 0.0) ||
                      (point.theta[k] >= upper_[k] && downhill[k] >= 0.0);
    if (!held) list.push_back(k);
  }
  return list;
}

Summary Evaluator::finish(const char* method, Status status, const Point& point) {
  summary_.method = method;
  summary_.status = status;
  summary_.theta = point.theta;
  summary_.sum_of_squares = 2.0 * point.phi;
  summary_.at_bound = (point.theta.array() <= lower_.array()).any() ||
                      (point.theta.array() >= upper_.array()).any();
  return summary_;
}

Eigen::MatrixXd columns(const Eigen::MatrixXd& matrix, const std::vector<int>& free) {
  Eigen::MatrixXd out(matrix.rows(), static_cast<Eigen::Index>(free.size()));
  for (std::size_t k = 0; k < free.size(); ++k)
    out.col(static_cast<Eigen::Index>(k)) = matrix.col(free[k]);
  return out;
}

Eigen::VectorXd lengths(const Eigen::VectorXd& norms, const std::vector<int>& free) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(free.size()));
  for (std::size_t k = 0; k < free.size(); ++k)
    out[static_cast<Eigen::Index>(k)] = norms[free[k]] > 0.0 ? norms[free[k]] : 1.0;
  return out;
}

Eigen::VectorXd spread(const Eigen::VectorXd& step, const std::vector<int>& free, int parameters) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(parameters);
  for (std::size_t k = 0; k < free.size(); ++k)
    out[free[k]] = step[static_cast<Eigen::Index>(k)];
  return out;
}

// Columns are first scaled to unit length, so that the singular values depend on the data and not
// on units. kRankTolerance is then the rounding of a double.
LinearStep linear_step(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& e) {
  constexpr double kRankTolerance = 1e-13;
  LinearStep out;
  out.step = Eigen::VectorXd::Zero(jacobian.cols());
  if (jacobian.cols() == 0) return out;
  Eigen::VectorXd scale = jacobian.colwise().norm();
  for (Eigen::Index k = 0; k < scale.size(); ++k)
    scale[k] = scale[k] > 0.0 ? scale[k] : 1.0;
  const Eigen::MatrixXd unit = jacobian * scale.cwiseInverse().asDiagonal();
  const SingularValues svd = singular_values_of(unit);
  const Eigen::VectorXd projected = svd.u.transpose() * e;
  double explained = 0.0;
  for (Eigen::Index i = 0; i < svd.values.size(); ++i) {
    const double sigma = svd.values[i];
    if (!(sigma > kRankTolerance * svd.values[0])) break;
    ++out.rank;
    explained += projected[i] * projected[i];
    out.step += projected[i] / sigma * svd.v.col(i);
  }
  out.step = out.step.cwiseQuotient(scale);
  const double norm = e.norm();
  out.offset = norm > 0.0 ? std::sqrt(explained) / norm : 0.0;
  return out;
}

double relative(const Eigen::VectorXd& step, const Eigen::VectorXd& theta) {
  double worst = 0.0;
  for (Eigen::Index k = 0; k < step.size(); ++k)
    worst = std::max(worst, std::fabs(step[k]) / std::max(std::fabs(theta[k]), 1e-300));
  return worst;
}

}  // namespace shaker::estimator::optimisers
