#include "daemon/cycles/cycle_noise.hpp"

#include <cmath>
#include <numbers>

namespace shaker::daemon {

std::array<std::complex<double>, kStrokeHarmonics> stroke_harmonics(std::span<const double> cycle) {
  std::array<std::complex<double>, kStrokeHarmonics> c{};
  const double n = static_cast<double>(cycle.size());
  for (std::size_t i = 0; i < cycle.size(); ++i) {
    const auto turn = std::polar(1.0, -2.0 * std::numbers::pi * static_cast<double>(i) / n);
    std::complex<double> power = 1.0;
    for (auto& h : c) {
      h += cycle[i] * power;
      power *= turn;
    }
  }
  c[0] /= n;
  for (std::size_t h = 1; h < c.size(); ++h)
    c[h] *= 2.0 / n;
  return c;
}

void CycleNoise::restart(std::size_t points) {
  count_ = 0;
  squares_ = 0.0;
  mean_.assign(points, 0.0);
  harmonic_mean_ = {};
  products_ = {};
}

void CycleNoise::add(std::span<const double> cycle) {
  ++count_;
  const double n = static_cast<double>(count_);
  for (std::size_t i = 0; i < mean_.size(); ++i) {
    const double step = cycle[i] - mean_[i];
    mean_[i] += step / n;
    squares_ += step * (cycle[i] - mean_[i]);
  }
  const auto c = stroke_harmonics(cycle);
  for (std::size_t h = 0; h < c.size(); ++h) {
    const auto step = c[h] - harmonic_mean_[h];
    harmonic_mean_[h] += step / n;
    const auto rest = c[h] - harmonic_mean_[h];
    products_[h].rr += step.real() * rest.real();
    products_[h].ri += step.real() * rest.imag();
    products_[h].ii += step.imag() * rest.imag();
  }
}

double CycleNoise::point_standard_deviation() const {
  if (count_ < 2) return 0.0;
  return std::sqrt(squares_ / static_cast<double>(count_ - 1) / static_cast<double>(mean_.size()));
}

CycleNoise::Covariance CycleNoise::covariance(std::size_t harmonic) const {
  if (count_ < 2) return {};
  const auto& p = products_[harmonic];
  const double size = std::abs(harmonic_mean_[harmonic]);
  const auto along = size > 0.0 ? harmonic_mean_[harmonic] / size : std::complex<double>(1.0);
  const double x = along.real(), y = along.imag(), f = 1.0 / static_cast<double>(count_ - 1);
  return {.along = f * (x * x * p.rr + 2.0 * x * y * p.ri + y * y * p.ii),
          .across = f * (y * y * p.rr - 2.0 * x * y * p.ri + x * x * p.ii),
          .mixed = f * (x * y * (p.ii - p.rr) + (x * x - y * y) * p.ri)};
}

}  // namespace shaker::daemon
