#include "estimator/drop/internal/covariance_axes.hpp"

#include <cmath>

#include <Eigen/Dense>

#include "estimator/math/dense.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// A number that the data leave open is held by its bounds: they count as a normal prior of half
// their distance.
void hold_by_bounds(const std::vector<double>& half_range, MatrixXd& v) {
  for (Index k = 0; k < v.rows(); ++k) {
    const double prior = half_range[static_cast<std::size_t>(k)];
    if (!(v(k, k) > 1e-4 * prior * prior) || !std::isfinite(prior)) continue;
    const VectorXd along = v.col(k);
    v -= along * along.transpose() / (v(k, k) + prior * prior);
  }
}

}  // namespace

std::vector<std::vector<double>> covariance_axes(const DamperHypothesis& damper,
                                                 const std::vector<double>& half_range) {
  const auto size = static_cast<Index>(damper.numbers.size());
  std::vector<std::vector<double>> axes;
  if (size == 0 || damper.covariance.size() != static_cast<std::size_t>(size * size)) return axes;
  MatrixXd v = Eigen::Map<const MatrixXd>(damper.covariance.data(), size, size);
  hold_by_bounds(half_range, v);
  const VectorXd error = v.diagonal().cwiseMax(0.0).cwiseSqrt();
  const VectorXd inverse = error.unaryExpr([](double e) { return e > 0.0 ? 1.0 / e : 0.0; });
  v = inverse.asDiagonal() * v * inverse.asDiagonal();
  const Spectrum eigen = spectrum_of(0.5 * (v + v.transpose()));
  for (Index k = 0; k < size; ++k) {
    if (!(eigen.values[k] > 0.0)) continue;
    const VectorXd axis = std::sqrt(eigen.values[k]) * error.asDiagonal() * eigen.vectors.col(k);
    axes.emplace_back(axis.data(), axis.data() + size);
  }
  return axes;
}

}  // namespace shaker::estimator
