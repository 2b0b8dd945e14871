#include "estimator/online/cycle_picture.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "estimator/math/harmonic_basis.hpp"
#include "estimator/model/model_arrays.hpp"

namespace shaker::estimator::online {
namespace {

constexpr double kFullTurn = 2.0 * std::numbers::pi;

bool can_be_imposed(const Model& model, std::size_t points) {
  return model.coordinates() == 1 && model.instruments().empty() && !model.needs_carrier() &&
         points > 2 * static_cast<std::size_t>(kMotionHarmonics);
}

}  // namespace

std::vector<double> missing_force(const Model& model, const std::vector<double>& theta,
                                  const MeasuredCycle& cycle) {
  const std::vector<double>& stroke = cycle.displacement;
  if (!can_be_imposed(model, stroke.size())) return {};
  const int n = static_cast<int>(stroke.size());
  ModelArrays at;
  at.shape(model, n);
  double mean = 0.0;
  for (const double value : stroke)
    mean += value / n;
  std::fill_n(at.u[0], n, mean);
  for (int h = 1; h <= kMotionHarmonics; ++h) {
    const std::complex<double> c = 2.0 / n * fourier_sum(stroke, h);
    const double omega = kFullTurn * h * cycle.frequency_hz;
    for (int i = 0; i < n; ++i) {
      const std::complex<double> term = c * std::conj(fourier_factor(h, i, n));
      at.u[0][i] += term.real();
      at.v[0][i] -= omega * term.imag();
      at.a[0][i] -= omega * omega * term.real();
    }
  }
  for (int i = 0; i < n; ++i)
    at.x[i] = cycle.excitation.empty() ? cycle.amplitude * harmonic_term(1, i, n)
                                       : cycle.excitation[static_cast<std::size_t>(i)];
  if (!at.evaluate(model, n, theta.data())) return {};
  std::vector<double> missing(at.g[0], at.g[0] + n);
  for (double& value : missing)
    value = -value;
  return missing;
}

}  // namespace shaker::estimator::online
