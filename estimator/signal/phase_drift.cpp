#include "estimator/signal/phase_drift.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace shaker::estimator {
namespace {

constexpr double kRadiansPerTurn = 2.0 * std::numbers::pi;
constexpr double kMaxDrift = 2e-3;       // in periods; an oleo's noise of about 0.1 mm hides less
constexpr double kMaxDriftErrors = 5.0;  // in standard errors

// The phase of the fundamental in each whole period, in turns, unwrapped; the first one is 0.
std::vector<double> phases(const std::vector<double>& t, const std::vector<double>& excitation,
                           double frequency_hz) {
  double mean = 0.0;
  for (const double x : excitation)
    mean += x / static_cast<double>(excitation.size());
  const double first = std::ceil(t.front() * frequency_hz - 1e-9);
  const double step = (t.back() - t.front()) / static_cast<double>(t.size() - 1) * frequency_hz;
  const double whole = std::floor(t.back() * frequency_hz + step - first + 1e-9);
  if (!(whole >= 1.0)) return {};
  std::vector<std::complex<double>> sums(static_cast<std::size_t>(whole));
  for (std::size_t i = 0; i < t.size(); ++i) {
    const double turn = t[i] * frequency_hz - first + 1e-9;
    if (turn >= 0.0 && turn < whole)
      sums[static_cast<std::size_t>(turn)] +=
          (excitation[i] - mean) * std::polar(1.0, -kRadiansPerTurn * turn);
  }
  std::vector<double> out = {0.0};
  for (std::size_t k = 1; k < sums.size(); ++k)
    out.push_back(out.back() + std::arg(sums[k] * std::conj(sums[k - 1])) / kRadiansPerTurn);
  return out;
}

}  // namespace

bool PhaseDrift::spoils_cycles() const {
  return std::fabs(turns) >= std::max(kMaxDrift, kMaxDriftErrors * error);
}

PhaseDrift phase_drift(const std::vector<double>& t, const std::vector<double>& excitation,
                       double frequency_hz) {
  const std::vector<double> phase = phases(t, excitation, frequency_hz);
  const auto count = static_cast<double>(phase.size());
  if (phase.size() < 4) return {};
  double mean = 0.0, sxx = 0.0, sxy = 0.0, left = 0.0;
  for (const double p : phase)
    mean += p / count;
  const auto at = [&](std::size_t k) { return static_cast<double>(k) - 0.5 * (count - 1.0); };
  for (std::size_t k = 0; k < phase.size(); ++k) {
    sxx += at(k) * at(k);
    sxy += at(k) * (phase[k] - mean);
  }
  const double slope = sxy / sxx;
  for (std::size_t k = 0; k < phase.size(); ++k)
    left += std::pow(phase[k] - mean - slope * at(k), 2);
  const double error = std::sqrt(left / (count - 2.0) / sxx);
  return {slope * (count - 1.0), error * (count - 1.0), frequency_hz * (1.0 + slope)};
}

}  // namespace shaker::estimator
