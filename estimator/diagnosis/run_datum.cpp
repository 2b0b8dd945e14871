#include "estimator/diagnosis/internal/run_datum.hpp"

#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/math/dense.hpp"

namespace shaker::estimator::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

bool same(const VectorXd& a, const VectorXd& b) {
  return a.size() == b.size() && a == b;
}

// Harmonics of the displacement.
const VectorXd& motion_of(const RunDatum& datum) {
  return datum.motion.size() > 0 ? datum.motion : datum.response;
}

bool periodic_response(const RunDatum& datum) {
  return !datum.sampled && datum.kind == Kind::periodic;
}

bool of_one_response(const RunDatum& a, const RunDatum& b) {
  return periodic_response(a) && periodic_response(b) && a.role == b.role &&
         a.frequency_hz == b.frequency_hz && same(a.driver, b.driver) &&
         same(motion_of(a), motion_of(b));
}

}  // namespace

bool on_samples(const std::vector<RunDatum>& data) {
  return !data.empty() && data.front().sampled != nullptr;
}

std::size_t first_of_response(const std::vector<RunDatum>& data, std::size_t k) {
  std::size_t first = 0;
  while (first < k && !of_one_response(data[first], data[k]))
    ++first;
  return first;
}

VectorXd without_own_zero(const RunDatum& datum, VectorXd harmonics) {
  if (datum.own_zero > 0.0 && harmonics.size() > 0) harmonics[0] = 0.0;
  return harmonics;
}

double root_mean_square(const VectorXd& harmonics) {
  if (harmonics.size() == 0) return 0.0;
  return std::sqrt(harmonics[0] * harmonics[0] +
                   0.5 * harmonics.tail(harmonics.size() - 1).squaredNorm());
}

void set_covariance(RunDatum& datum, const MatrixXd& covariance) {
  datum.error = covariance.diagonal().cwiseSqrt();
  // Factorised as correlations: variances may differ by many orders.
  const VectorXd scale = datum.error.cwiseInverse();
  MatrixXd correlation = scale.asDiagonal() * covariance * scale.asDiagonal();
  correlation.diagonal().array() += 1e-12;
  const Cholesky factors(correlation);
  if (!factors.positive() || !datum.error.allFinite())
    throw std::invalid_argument(
        fmt::format("run {}: the noise has no positive definite covariance", datum.name));
  datum.whitening = std::make_shared<const MatrixXd>(factors.whiten(MatrixXd(scale.asDiagonal())));
}

MatrixXd covariance_of(const RunDatum& datum) {
  if (!datum.whitening) return datum.error.cwiseAbs2().asDiagonal();
  const auto size = datum.whitening->rows();
  const MatrixXd factor = lower_solve(*datum.whitening, MatrixXd(MatrixXd::Identity(size, size)));
  return factor * factor.transpose();
}

MatrixXd whitened(const RunDatum& datum, const MatrixXd& columns) {
  if (!datum.whitening) return datum.error.cwiseInverse().asDiagonal() * columns;
  return lower_times(*datum.whitening, columns);
}

MatrixXd coloured(const RunDatum& datum, const MatrixXd& white) {
  if (!datum.whitening) return datum.error.asDiagonal() * white;
  return lower_solve(*datum.whitening, white);
}

VectorXd over_covariance(const RunDatum& datum, const VectorXd& left) {
  const VectorXd white = whitened(datum, left);
  if (!datum.whitening) return white.cwiseQuotient(datum.error);
  return lower_transposed_times(*datum.whitening, white);
}

double log_scale(const RunDatum& datum) {
  if (!datum.whitening) return datum.error.array().log().sum();
  return -datum.whitening->diagonal().array().log().sum();
}

}  // namespace shaker::estimator::diagnosis
