#include "estimator/online/internal/extended_kalman.hpp"

#include <algorithm>
#include <stdexcept>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "estimator/math/dense.hpp"

namespace shaker::estimator::online {

ExtendedKalman::ExtendedKalman(const Model& model, std::vector<double> start, KalmanOptions options)
    : model_(&model),
      options_(std::move(options)),
      predictor_(model, options_.grid_points),
      theta_(std::move(start)) {
  const auto p = static_cast<std::size_t>(predictor_.parameters());
  if (options_.first_deviation.size() != p ||
      (!options_.drift.empty() && options_.drift.size() != p))
    throw std::invalid_argument(
        fmt::format("the filter has {} free parameters; it was given {} deviations and {} drifts",
                    p, options_.first_deviation.size(), options_.drift.size()));
  if (!(options_.noise > 0.0))
    throw std::invalid_argument("the filter's noise must be above 0: the sensor's, of one point");
  covariance_.setZero(predictor_.parameters(), predictor_.parameters());
  for (std::size_t k = 0; k < p; ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    covariance_(at, at) = options_.first_deviation[k] * options_.first_deviation[k];
  }
}

bool ExtendedKalman::add(const MeasuredCycle& cycle) {
  Prediction at;
  if (!predictor_.predict(cycle, theta_, false, at)) return false;
  const auto p = covariance_.rows();
  Eigen::MatrixXd before = covariance_;
  for (std::size_t k = 0; k < options_.drift.size(); ++k)
    before(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(k)) +=
        options_.drift[k] * options_.drift[k];
  const Eigen::VectorXd e =
      Eigen::Map<const Eigen::VectorXd>(cycle.displacement.data(), at.displacement.size()) -
      at.displacement;
  const double weight = 1.0 / (options_.noise * options_.noise);
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(p, p);
  const Eigen::MatrixXd information =
      Ldlt(before).solve(identity) + weight * at.jacobian.transpose() * at.jacobian;
  const Eigen::MatrixXd after = Ldlt(information).solve(identity);
  const Eigen::VectorXd step = weight * after * (at.jacobian.transpose() * e);
  std::vector<double> theta = theta_;
  for (Eigen::Index k = 0; k < p; ++k) {
    const auto index = static_cast<std::size_t>(predictor_.free()[static_cast<std::size_t>(k)]);
    const ModelParameter& parameter = model_->parameters()[index];
    theta[index] = std::clamp(theta[index] + step[k], parameter.lower, parameter.upper);
  }
  if (!predictor_.predict(cycle, theta, false, at)) return false;
  theta_ = theta;
  covariance_ = 0.5 * (after + after.transpose());
  return true;
}

}  // namespace shaker::estimator::online
