#include "estimator/signal/cycles.hpp"

#include <algorithm>
#include <cmath>

namespace shaker::estimator {
namespace {

constexpr std::size_t kPointsOfCheckedCycle = 32;
constexpr std::size_t kMinPointsInPeriod = 8;
constexpr double kPhaseTolerance = 1e-6;  // in periods: far below the resolution of any sensor
constexpr double kPhaseRounding = 1e-9;   // in periods

// Lagrange's cubic through the four samples around `at`.
double cubic_at(const std::vector<double>& t, const std::vector<double>& y, double at) {
  const auto next = std::upper_bound(t.begin(), t.end(), at) - t.begin();
  const auto last = static_cast<std::ptrdiff_t>(t.size()) - 4;
  const auto first = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(next - 2, 0, last));
  double value = 0.0;
  for (std::size_t j = first; j < first + 4; ++j) {
    double weight = y[j];
    for (std::size_t k = first; k < first + 4; ++k) {
      if (k != j) weight *= (at - t[k]) / (t[j] - t[k]);
    }
    value += weight;
  }
  return value;
}

}  // namespace

double phase_of(double t, double frequency_hz) {
  const double tau = t * frequency_hz;
  const double part = tau - std::floor(tau);
  return part < 1.0 ? part : 0.0;
}

std::size_t points_of_equal_steps(const std::vector<double>& t, double frequency_hz) {
  const double span = (t.back() - t.front()) / static_cast<double>(t.size() - 1) * frequency_hz;
  const auto n = static_cast<std::size_t>(std::llround(1.0 / span));
  if (n < kMinPointsInPeriod) return 0;
  const double begin = std::round(t.front() * frequency_hz);
  for (std::size_t i = 0; i < t.size(); ++i) {
    const double expected = static_cast<double>(i) / static_cast<double>(n);
    if (std::abs(t[i] * frequency_hz - expected - begin) > kPhaseTolerance) return 0;
  }
  return n;
}

Cycles cycles_of(const std::vector<double>& t, const std::vector<double>& y, double frequency_hz) {
  if (const std::size_t n = points_of_equal_steps(t, frequency_hz))
    return {{y.begin(), y.begin() + static_cast<std::ptrdiff_t>(y.size() / n * n)}, n};
  const double first = std::ceil(t.front() * frequency_hz - kPhaseRounding);
  const double turns = (t.back() - t.front()) * frequency_hz;
  if (static_cast<double>(t.size() - 1) < kMinSamplesForCubic * turns) return {};
  // The last step may reach to the end of a period without a sample there.
  const double beyond = turns / static_cast<double>(t.size() - 1);
  const double whole = std::floor(t.back() * frequency_hz + beyond - first + kPhaseRounding);
  constexpr auto kPoints = static_cast<double>(kPointsOfCheckedCycle);
  Cycles out{{}, kPointsOfCheckedCycle};
  for (std::size_t i = 0; static_cast<double>(i) < whole * kPoints; ++i) {
    const double turn = first + static_cast<double>(i) / kPoints;
    out.y.push_back(cubic_at(t, y, std::min(turn / frequency_hz, t.back())));
  }
  return out;
}

double MeanCycle::standard_error() const {
  if (cycles < 2.0 || mean.empty()) return 0.0;
  return std::sqrt(scatter / (static_cast<double>(mean.size()) * cycles * (cycles - 1.0)));
}

MeanCycle mean_cycle(std::span<const double> y, std::size_t points) {
  const std::size_t cycles = y.size() / points;
  MeanCycle out{std::vector<double>(points, 0.0), 0.0, static_cast<double>(cycles)};
  for (std::size_t i = 0; i < cycles * points; ++i)
    out.mean[i % points] += y[i] / out.cycles;
  for (std::size_t i = 0; i < cycles * points; ++i) {
    const double off = y[i] - out.mean[i % points];
    out.scatter += off * off;
  }
  return out;
}

MeanChannels mean_channels(const std::vector<std::vector<double>>& channels, std::size_t points) {
  const std::size_t m = channels.size(), total = channels.front().size();
  MeanChannels out;
  for (const std::vector<double>& channel : channels) {
    MeanCycle own = mean_cycle(channel, points);
    out.mean.push_back(std::move(own.mean));
    out.cycles = own.cycles;
  }
  if (total == points) return out;
  out.scatter.assign(m * m, 0.0);
  for (std::size_t i = 0; i < total; ++i) {
    for (std::size_t a = 0; a < m; ++a) {
      for (std::size_t b = 0; b < m; ++b)
        out.scatter[a * m + b] +=
            (channels[a][i] - out.mean[a][i % points]) * (channels[b][i] - out.mean[b][i % points]);
    }
  }
  return out;
}

CycleExcitation mean_excitation(const std::vector<CycleExcitation>& cycles) {
  CycleExcitation out;
  const auto count = static_cast<double>(cycles.size());
  out.samples.assign(cycles.back().samples.size(), 0.0);
  double variance = 0.0;
  for (const CycleExcitation& cycle : cycles) {
    out.frequency_hz += cycle.frequency_hz / count;
    out.amplitude += cycle.amplitude / count;
    variance += cycle.error * cycle.error / (count * count);
    for (std::size_t i = 0; i < out.samples.size(); ++i)
      out.samples[i] += cycle.samples[i] / count;
  }
  out.error = std::sqrt(variance);
  return out;
}

}  // namespace shaker::estimator
