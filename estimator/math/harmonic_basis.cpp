#include "estimator/math/harmonic_basis.hpp"

#include <cmath>
#include <numbers>

namespace shaker::estimator {
namespace {

double angle_on_grid(int harmonic, int point, int points) {
  return 2.0 * std::numbers::pi *
         static_cast<double>(static_cast<long>(harmonic) * point % points) / points;
}

}  // namespace

// Each harmonic is that before, turned by the first.
void fill_harmonic_row(double tau, std::span<double> row) {
  row[0] = 1.0;
  const std::complex<double> first = std::polar(1.0, 2.0 * std::numbers::pi * tau);
  std::complex<double> turned = 1.0;
  for (std::size_t term = 1; term < row.size(); ++term) {
    if (term % 2 == 1)
      turned = {turned.real() * first.real() - turned.imag() * first.imag(),
                turned.imag() * first.real() + turned.real() * first.imag()};
    row[term] = term % 2 == 1 ? turned.real() : turned.imag();
  }
}

double harmonic_term(int term, int point, int points) {
  if (term == 0) return 1.0;
  const double angle = angle_on_grid((term + 1) / 2, point, points);
  return term % 2 == 1 ? std::cos(angle) : std::sin(angle);
}

std::complex<double> fourier_factor(int harmonic, int point, int points, double size) {
  return std::polar(size, -angle_on_grid(harmonic, point, points));
}

std::complex<double> fourier_sum(std::span<const double> samples, int harmonic, double size) {
  const auto n = static_cast<int>(samples.size());
  std::complex<double> sum = 0.0;
  for (int i = 0; i < n; ++i)
    sum += samples[static_cast<std::size_t>(i)] * fourier_factor(harmonic, i, n, size);
  return sum;
}

}  // namespace shaker::estimator
