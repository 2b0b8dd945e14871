#include "estimator/diagnosis/select/internal/model_error.hpp"

#include <cmath>

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::VectorXd;

constexpr double kFarFromNoise = 3.0;    // root mean square of what is left, over the noise's
constexpr double kNextToNothing = 3e-3;  // of the base model's: nothing is left to share out

VectorXd left_of_run(const HarmonicFit& fit, const std::vector<RunDatum>& data, std::size_t r) {
  return without_own_zero(data[r], data[r].response - fit.predictions[r].value());
}

double left_by(const HarmonicFit& fit, const std::vector<RunDatum>& data) {
  double sum = 0.0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role == Role::fit && data[r].quantity == Quantity::displacement)
      sum += std::pow(root_mean_square(left_of_run(fit, data, r)), 2);
  }
  return std::sqrt(sum);
}

double noise_of(const std::vector<RunDatum>& data) {
  double sum = 0.0;
  for (const RunDatum& datum : data) {
    if (datum.role == Role::fit && datum.quantity == Quantity::displacement)
      sum += std::pow(root_mean_square(without_own_zero(datum, datum.error)), 2);
  }
  return std::sqrt(sum);
}

// Mean square of the residual of one channel's components.
double left_of(const HarmonicFit& fit, const std::vector<RunDatum>& data, Quantity quantity) {
  double sum = 0.0, count = 0.0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role != Role::fit || data[r].quantity != quantity) continue;
    sum += left_of_run(fit, data, r).squaredNorm();
    count += static_cast<double>(data[r].response.size());
  }
  return count > 0.0 ? sum / count : 0.0;
}

}  // namespace

std::optional<std::vector<RunDatum>> with_model_error(const Selection& found,
                                                      const std::vector<RunDatum>& data) {
  if (found.adequate || found.explained) return std::nullopt;
  const HarmonicFit* best = found.base.fit.get();
  for (const Hypothesis& h : found.hypotheses) {
    if (h.disqualified.empty() && std::isfinite(h.fit->chi_squared) &&
        left_by(*h.fit, h.data ? *h.data : data) < left_by(*best, data))
      best = h.fit.get();
  }
  // The cosines of a record may differ in their noise by orders of magnitude, so each is counted by
  // itself.
  const bool record = on_samples(data);
  const double far = record ? std::sqrt(best->chi_squared / best->observations)
                            : left_by(*best, data) / noise_of(data);
  if (far < kFarFromNoise) return std::nullopt;
  if (left_by(*best, data) < kNextToNothing * left_by(*found.base.fit, data)) return std::nullopt;
  std::vector<RunDatum> softened = data;
  for (RunDatum& datum : softened) {
    const double left = left_of(*best, data, datum.quantity);
    if (!datum.whitening) {
      datum.error = (datum.error.array().square() + left).sqrt();
      continue;
    }
    Eigen::MatrixXd covariance = covariance_of(datum);
    covariance.diagonal().array() += left;
    set_covariance(datum, covariance);
  }
  return softened;
}

}  // namespace shaker::estimator::diagnosis
