#include "daemon/cycles/cycle_noise.hpp"

#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace shaker::daemon {

namespace {

// The mean has no imaginary part.
void spread(std::complex<double> c, std::size_t h,
            std::array<double, CycleNoise::kCoefficients>& into) {
  if (h == 0) {
    into[0] = c.real();
  } else {
    into[2 * h - 1] = c.real();
    into[2 * h] = c.imag();
  }
}

}  // namespace

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
  std::array<double, kCoefficients> step{}, rest{};
  for (std::size_t h = 0; h < c.size(); ++h) {
    const auto before = c[h] - harmonic_mean_[h];
    harmonic_mean_[h] += before / n;
    spread(before, h, step);
    spread(c[h] - harmonic_mean_[h], h, rest);
  }
  for (std::size_t i = 0; i < kCoefficients; ++i) {
    for (std::size_t k = 0; k < kCoefficients; ++k)
      products_[i][k] += step[i] * rest[k];
  }
}

double CycleNoise::point_standard_deviation() const {
  if (count_ < 2) return 0.0;
  return std::sqrt(squares_ / static_cast<double>(count_ - 1) / static_cast<double>(mean_.size()));
}

CycleNoise::Matrix CycleNoise::covariance() const {
  Matrix turned{};
  if (count_ < 2) return turned;
  // Rotates into each harmonic's own direction: (along, across) = R (real, imaginary), rows
  // first.
  const auto turn = [&](std::size_t h, double& real, double& imaginary) {
    const double size = std::abs(harmonic_mean_[h]);
    if (size == 0.0) return;
    const auto e = harmonic_mean_[h] / size;
    const double along = e.real() * real + e.imag() * imaginary;
    imaginary = e.real() * imaginary - e.imag() * real;
    real = along;
  };
  turned = products_;
  for (std::size_t h = 1; h < kStrokeHarmonics; ++h) {
    for (std::size_t k = 0; k < kCoefficients; ++k)
      turn(h, turned[2 * h - 1][k], turned[2 * h][k]);
  }
  for (std::size_t h = 1; h < kStrokeHarmonics; ++h) {
    for (std::size_t i = 0; i < kCoefficients; ++i)
      turn(h, turned[i][2 * h - 1], turned[i][2 * h]);
  }
  for (auto& row : turned) {
    for (double& value : row)
      value /= static_cast<double>(count_ - 1);
  }
  return turned;
}

CycleNoise::Covariance CycleNoise::covariance(std::size_t harmonic) const {
  const Matrix all = covariance();
  if (harmonic == 0) return {.along = all[0][0]};
  const std::size_t along = 2 * harmonic - 1, across = 2 * harmonic;
  return {.along = all[along][along], .across = all[across][across], .mixed = all[along][across]};
}

std::string repeatability(const CycleNoise& noise, double sensor) {
  if (noise.cycles() < 2) return "one alone does not tell how well they repeat";
  const double scatter = noise.point_standard_deviation();
  if (scatter <= sensor) {
    return fmt::format(
        "they repeat as well as the sensor can tell: a point differs from cycle to cycle by {:.2e} "
        "m",
        scatter);
  }
  return fmt::format(
      "a point differs from cycle to cycle by {:.2e} m, of which the sensor's own noise is {:.2e} "
      "m",
      scatter, sensor);
}

}  // namespace shaker::daemon
