#include "daemon/cycles/harmonic_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>

namespace shaker::daemon {
namespace {

constexpr int kUnknowns = 1 + 2 * kExcitationHarmonics;
using Row = Eigen::Matrix<double, kUnknowns, 1>;
using Normal = Eigen::Matrix<double, kUnknowns, kUnknowns>;
constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kOutlier = 8.0;  // robust standard deviations

void fill(Row& row, double angle) {
  const std::complex<double> turn = std::polar(1.0, angle);
  std::complex<double> power = turn;
  row[0] = 1.0;
  for (int h = 0; h < kExcitationHarmonics; ++h, power *= turn) {
    row[1 + 2 * h] = power.real();
    row[2 + 2 * h] = -power.imag();  // Re(c e^{ia}) = Re c cos a - Im c sin a
  }
}

}  // namespace

double HarmonicFit::turns() const {
  return std::arg(c[0]) / kTwoPi;
}

double HarmonicFit::periodic_part(double turns_after_peak) const {
  const double angle = kTwoPi * turns_after_peak - std::arg(c[0]);
  double value = 0.0;
  for (int h = 0; h < kExcitationHarmonics; ++h) {
    value += (c[static_cast<std::size_t>(h)] * std::polar(1.0, (h + 1) * angle)).real();
  }
  return value;
}

HarmonicFit HarmonicFitter::fit(std::span<const double> t, std::span<const double> v,
                                double frequency_hz) {
  HarmonicFit result;
  const std::size_t n = t.size();
  if (n < 2 * kUnknowns) return result;
  scratch_.resize(2 * n);
  const std::span<double> residual(scratch_.data(), n), sorted(scratch_.data() + n, n);
  std::ranges::fill(residual, 0.0);
  double limit = 1.0;  // first pass: every residual is 0 and passes
  for (int pass = 0; pass < 2; ++pass) {
    Normal a = Normal::Zero();
    Row b = Row::Zero(), row;
    long used = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (std::abs(residual[i]) > limit) continue;
      fill(row, kTwoPi * frequency_hz * t[i]);
      a.selfadjointView<Eigen::Lower>().rankUpdate(row);
      b += v[i] * row;
      ++used;
    }
    if (used < 2 * kUnknowns) return {};
    const Eigen::LDLT<Normal> factor(a.selfadjointView<Eigen::Lower>());
    if (factor.info() != Eigen::Success ||
        !(factor.vectorD().minCoeff() > 1e-9 * factor.vectorD().maxCoeff()))
      return {};
    const Row x = factor.solve(b);
    double sum = 0.0;
    bool outliers = false;
    for (std::size_t i = 0; i < n; ++i) {
      const bool was_in = std::abs(residual[i]) <= limit;
      fill(row, kTwoPi * frequency_hz * t[i]);
      residual[i] = v[i] - row.dot(x);
      sorted[i] = std::abs(residual[i]);
      if (was_in) sum += residual[i] * residual[i];
    }
    result = {.ok = true,
              .mean = x[0],
              .c = {},
              .noise = std::sqrt(sum / double(used - kUnknowns)),
              .used = used};
    for (int h = 0; h < kExcitationHarmonics; ++h) {
      result.c[static_cast<std::size_t>(h)] = {x[1 + 2 * h], x[2 + 2 * h]};
    }
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(n / 2);
    std::ranges::nth_element(sorted, middle);
    limit = kOutlier * 1.4826 * *middle + 1e-12 * (std::abs(result.mean) + result.amplitude());
    for (const double r : residual)
      outliers = outliers || std::abs(r) > limit;
    if (!outliers) break;
  }
  return result;
}

}  // namespace shaker::daemon
