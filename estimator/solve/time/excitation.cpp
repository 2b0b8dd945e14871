#include "estimator/solve/time/excitation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

namespace shaker::estimator {
namespace {

constexpr double kEven = 1e-6;  // of a step: smaller deviations are rounding of the time column

}  // namespace

Excitation Excitation::constant(double acceleration) {
  Excitation e;
  e.constant_ = acceleration;
  return e;
}

Excitation Excitation::cosine(double amplitude, double frequency_hz, double phase) {
  Excitation e;
  e.amplitude_ = amplitude;
  e.circular_ = 2.0 * std::numbers::pi * frequency_hz;
  e.phase_ = phase;
  return e;
}

Excitation Excitation::sampled(std::span<const double> t, std::span<const double> x) {
  if (t.size() != x.size())
    throw std::invalid_argument(
        fmt::format("excitation: {} times for {} values", t.size(), x.size()));
  if (t.size() < 2)
    throw std::invalid_argument("excitation: at least two samples are needed to know it between");
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (!std::isfinite(t[i]) || !std::isfinite(x[i]))
      throw std::invalid_argument(
          fmt::format("excitation: sample {} is not a finite number; leave it out", i + 1));
    if (i > 0 && !(t[i] > t[i - 1]))
      throw std::invalid_argument(fmt::format(
          "excitation: time does not increase at sample {} (t = {:.9g} s)", i + 1, t[i]));
  }
  Excitation e;
  e.t_.assign(t.begin(), t.end());
  e.x_.assign(x.begin(), x.end());
  const double step = (t.back() - t.front()) / static_cast<double>(t.size() - 1);
  bool even = true;
  for (std::size_t i = 0; i < t.size() && even; ++i)
    even = std::fabs(t[i] - t[0] - step * static_cast<double>(i)) < kEven * step;
  e.rate_ = even ? 1.0 / step : 0.0;
  return e;
}

Excitation& Excitation::add_constant(double acceleration) {
  constant_ += acceleration;
  return *this;
}

double Excitation::value(double t) const {
  double x = constant_;
  if (amplitude_ != 0.0) x += amplitude_ * std::cos(circular_ * t + phase_);
  if (!t_.empty()) x += interpolated(t);
  return x;
}

// Lagrange interpolation through the four samples around t, or through all if there are fewer. It
// is exact for cubics, so its error is of fourth order in the step, as that of the integration.
double Excitation::interpolated(double t) const {
  const std::size_t n = t_.size();
  if (t <= t_.front()) return x_.front();
  if (t >= t_.back()) return x_.back();
  std::size_t left = 0;
  if (rate_ > 0.0) {
    left = std::min(n - 2, static_cast<std::size_t>((t - t_.front()) * rate_));
  } else {
    left = static_cast<std::size_t>(std::upper_bound(t_.begin(), t_.end(), t) - t_.begin()) - 1;
  }
  const std::size_t count = std::min<std::size_t>(4, n);
  const std::size_t first = std::min(left > 0 ? left - 1 : 0, n - count);
  if (rate_ > 0.0 && count == 4) {
    const double s = (t - t_[first]) * rate_;  // samples after the first
    const double* x = &x_[first];
    const double a = s * (s - 3.0), b = (s - 1.0) * (s - 2.0);
    return (a * ((s - 2.0) * x[1] - (s - 1.0) * x[2])) * 0.5 +
           b * (s * x[3] - (s - 3.0) * x[0]) * (1.0 / 6.0);
  }
  double sum = 0.0;
  for (std::size_t i = first; i < first + count; ++i) {
    double weight = 1.0;
    for (std::size_t k = first; k < first + count; ++k) {
      if (k != i) weight *= (t - t_[k]) / (t_[i] - t_[k]);
    }
    sum += weight * x_[i];
  }
  return sum;
}

}  // namespace shaker::estimator
