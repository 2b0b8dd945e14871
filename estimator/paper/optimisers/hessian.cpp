#include "estimator/paper/optimisers/internal/hessian.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "estimator/math/dense.hpp"

namespace shaker::estimator::optimisers {

Eigen::MatrixXd rows_and_columns(const Eigen::MatrixXd& matrix, const std::vector<int>& free) {
  const auto n = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd out(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    for (Eigen::Index l = 0; l < n; ++l)
      out(k, l) = matrix(free[static_cast<std::size_t>(k)], free[static_cast<std::size_t>(l)]);
  }
  return out;
}

Eigen::VectorXd downhill_solve(const Eigen::MatrixXd& h, const Eigen::VectorXd& right) {
  constexpr double kFloor = 1e-14;
  Eigen::VectorXd scale = h.diagonal().cwiseAbs().cwiseSqrt();
  for (Eigen::Index k = 0; k < scale.size(); ++k)
    scale[k] = scale[k] > 0.0 ? 1.0 / scale[k] : 1.0;
  const Eigen::MatrixXd unit = scale.asDiagonal() * h * scale.asDiagonal();
  const Eigen::VectorXd scaled = scale.asDiagonal() * right;
  return scale.asDiagonal() * downhill_solve_above(unit, scaled, kFloor);
}

Eigen::VectorXd downhill_solve_above(const Eigen::MatrixXd& h, const Eigen::VectorXd& right,
                                     double floor) {
  const Spectrum eigen = spectrum_of(h);
  Eigen::VectorXd inverse = eigen.values.cwiseAbs();
  for (Eigen::Index k = 0; k < inverse.size(); ++k)
    inverse[k] = inverse[k] > floor ? 1.0 / inverse[k] : 0.0;
  const Eigen::MatrixXd& v = eigen.vectors;
  return v * (inverse.asDiagonal() * (v.transpose() * right));
}

bool curvature_along(Evaluator& evaluator, const Local& local, const Eigen::VectorXd& direction,
                     Eigen::VectorXd& out) {
  const Point& point = local.point;
  const Eigen::VectorXd whole = spread(direction, local.free, evaluator.problem().parameters());
  double h = 0.0;  // the step changes the parameter with the largest relative change by 1e-5
  for (Eigen::Index k = 0; k < whole.size(); ++k)
    h = std::max(h, std::fabs(whole[k]) / std::max(std::fabs(point.theta[k]), 1e-8));
  if (h == 0.0) return false;
  h = 1e-5 / h;
  Point side[2];
  bool good[2];
  for (int i = 0; i < 2; ++i) {
    const Eigen::VectorXd wanted = point.theta + (i == 0 ? h : -h) * whole;
    side[i].theta = wanted;
    // A side outside the box is not used, because into_box would change the direction.
    good[i] = evaluator.into_box(wanted) == wanted && evaluator.at(side[i], true);
  }
  const auto gradient = [&](const Point& p) {
    return Eigen::VectorXd(-columns(p.jacobian, local.free).transpose() * p.e);
  };
  Eigen::VectorXd along;
  if (good[0] && good[1])
    along = (gradient(side[0]) - gradient(side[1])) / (2.0 * h);
  else if (good[0])
    along = (gradient(side[0]) - gradient(point)) / h;
  else if (good[1])
    along = (gradient(point) - gradient(side[1])) / h;
  else
    return false;
  out = along - local.jacobian.transpose() * (local.jacobian * direction);
  return true;
}

}  // namespace shaker::estimator::optimisers
