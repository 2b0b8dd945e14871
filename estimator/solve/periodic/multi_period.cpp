#include "estimator/solve/periodic/multi_period.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>

#include "estimator/math/harmonic_basis.hpp"
#include "estimator/solve/periodic/continuation.hpp"

namespace shaker::estimator {
namespace {

std::complex<double> harmonic(std::span<const double> record, int h) {
  return fourier_sum(record, h) * ((h == 0 ? 1.0 : 2.0) / static_cast<double>(record.size()));
}

// The highest harmonic of the ring that the tests on a record use.
int last_harmonic(std::span<const double> record, int periods) {
  return std::min(12 * periods, (static_cast<int>(record.size()) - 1) / 2);
}

}  // namespace

void set_excitation_over(PeriodicSystem& system, int periods, double frequency_hz,
                         double amplitude) {
  std::vector<double> points = cosine_shape(system.points(), periods);
  for (double& x : points)
    x *= amplitude;
  system.set_excitation_points(frequency_hz / periods, points);
}

void start_from_record(PeriodicSystem& system, std::span<const double> record, int harmonics) {
  const int n = system.points();
  const int s = system.model().coordinates();
  const int last = std::min(harmonics, (static_cast<int>(record.size()) - 1) / 2);
  const auto state = system.state();
  const auto observed = [&](int i) -> double& {
    return state[static_cast<std::size_t>(i * s + system.model().observed())];
  };
  for (int i = 0; i < n; ++i)
    observed(i) = 0.0;
  for (int h = 0; h <= last; ++h) {
    const std::complex<double> c = harmonic(record, h);
    for (int i = 0; i < n; ++i)
      observed(i) += (c * std::conj(fourier_factor(h, i, n))).real();
  }
}

double subharmonic_share(std::span<const double> record, int periods) {
  const int last = last_harmonic(record, periods);
  double between = 0.0, all = 1e-300;
  for (int h = 1; h <= last; ++h) {
    const double energy = std::norm(harmonic(record, h));
    all += energy;
    if (h % periods != 0) between += energy;
  }
  return std::sqrt(between / all);
}

double subharmonic_share(const PeriodicSystem& system, int periods) {
  std::vector<double> record;
  for (int i = 0; i < system.points(); ++i)
    record.push_back(system.value(i, system.model().observed()));
  return subharmonic_share(record, periods);
}

bool subharmonic_stands_out(std::span<const double> record, int periods) {
  constexpr double kAboveNoise = 4.0;  // one record in 300 of white noise exceeds it
  std::vector<double> energy;
  for (int h = 1; h <= last_harmonic(record, periods); ++h) {
    if (h % periods != 0) energy.push_back(std::norm(harmonic(record, h)));
  }
  if (energy.empty()) return false;
  const double all = std::accumulate(energy.begin(), energy.end(), 0.0);
  const auto middle = energy.begin() + static_cast<std::ptrdiff_t>(energy.size() / 2);
  std::nth_element(energy.begin(), middle, energy.end());
  const double of_noise = *middle / std::numbers::ln2 * static_cast<double>(energy.size());
  return all > kAboveNoise * of_noise;
}

// The critical disturbance changes sign from one period to the next, so it is periodic on twice the
// ring and is the null vector of dg/dz there. The first step goes along it. The corrector solves in
// the plane normal to it, so Newton's method cannot return to the branch of half the period.
Branch Continuation::doubled(const Branch& branch, const SpecialPoint& at) {
  Branch out{branch.along, branch.held, branch.from, branch.to, 2 * branch.periods,
             {},           {},          false,       {}};
  SolutionArc arc = make_arc(out);
  const std::vector<double>& one = at.point.at.z;
  ArcPoint point{one, at.point.at.value};
  point.z.insert(point.z.end(), one.begin(), one.end());
  const std::size_t n = one.size();
  const std::size_t s = static_cast<std::size_t>(model_->coordinates());
  ArcPoint direction{std::vector<double>(2 * n), 0.0};
  for (std::size_t k = 0; k < 2 * n; ++k) {
    const double angle = std::numbers::pi * static_cast<double>(k / s) / static_cast<double>(n / s);
    direction.z[k] = std::cos(angle) + 0.7 * std::sin(angle) + 0.3 * std::cos(3.0 * angle + 1.0);
  }
  arc.set_scale(point, direction);
  if (!arc.critical_direction(point, direction)) {
    out.ended = "the critical direction at the period doubling could not be found";
    return out;
  }
  for (double first = 0.02; first >= 1e-4; first *= 0.5) {
    ArcPoint guess = point, start;
    for (std::size_t k = 0; k < 2 * n; ++k)
      guess.z[k] += first * direction.z[k];
    if (arc.correct(guess, direction, start, 20) == 0) continue;
    walk(arc, start, direction, out);
    return out;
  }
  out.ended = "no solution of twice the period was found next to the period doubling";
  return out;
}

}  // namespace shaker::estimator
