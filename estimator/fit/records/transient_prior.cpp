// A normal prior of the free parameters: one more row of the least squares for each of its principal
// axes.
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/fit/records/internal/transient_impl.hpp"
#include "estimator/math/dense.hpp"

namespace shaker::estimator {
namespace {

constexpr double kLeastVariance = 1e-10;  // of an axis, relative to the largest

}  // namespace

void TransientEstimator::Impl::set_prior() {
  if (!options.prior) return;
  const TransientPrior& prior = *options.prior;
  const auto size = static_cast<Eigen::Index>(free.size());
  if (prior.mean.size() != free.size() || prior.covariance.size() != free.size() * free.size())
    throw std::invalid_argument(fmt::format(
        "the prior has {} parameters, the model has {} free ones", prior.mean.size(), free.size()));
  if (!(prior.noise > 0.0)) throw std::invalid_argument("the noise of a prior must be above 0");
  if (size == 0) return;
  const Eigen::MatrixXd v = Eigen::Map<const Eigen::MatrixXd>(prior.covariance.data(), size, size);
  const Eigen::VectorXd error = v.diagonal().cwiseSqrt();
  if (!v.allFinite() || !(error.minCoeff() > 0.0))
    throw std::invalid_argument("the variances of a prior must be above 0");
  const Eigen::VectorXd inverse = error.cwiseInverse();
  const Spectrum eigen = spectrum_of(inverse.asDiagonal() * v * inverse.asDiagonal());
  const double least = kLeastVariance * eigen.values.maxCoeff();
  prior_root = eigen.values.cwiseMax(least).cwiseSqrt().cwiseInverse().asDiagonal() *
               eigen.vectors.transpose() * inverse.asDiagonal();
}

Eigen::MatrixXd TransientEstimator::Impl::prior_rows() {
  fit.prior_sum = 0.0;
  const auto q = static_cast<Eigen::Index>(unknowns.size());
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(prior_root.rows(), q + 1);
  if (prior_root.size() == 0) return rows;
  const TransientPrior& prior = *options.prior;
  Eigen::VectorXd off(prior_root.cols());
  for (std::size_t k = 0; k < free.size(); ++k)
    off[static_cast<Eigen::Index>(k)] =
        prior.mean[k] - fit.theta[static_cast<std::size_t>(free[k])];
  rows.leftCols(prior_root.cols()) = prior.noise * prior_root;
  const Eigen::VectorXd distance = prior_root * off;
  rows.col(q) = prior.noise * distance;
  fit.prior_sum = distance.squaredNorm();
  return rows;
}

}  // namespace shaker::estimator
