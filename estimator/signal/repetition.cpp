#include "estimator/signal/repetition.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/math/harmonic_basis.hpp"
#include "estimator/signal/cycle_courses.hpp"
#include "estimator/signal/stationarity.hpp"

namespace shaker::estimator {
namespace {

// Threshold of a ratio of scatters: cycles that alternate by twice the noise of their
// difference reach it. Weaker alternation changes a mean cycle only by its square, which is
// below the noise.
const double kScatterRatio = std::sqrt(3.0);
constexpr double kMaxOverNoise = 3.0;   // scatter over white noise; slow drift of a rig reaches 2
constexpr double kMaxOfMotion = 0.02;   // relative to the motion; below it is the drift of a rig
constexpr double kSettlingRatio = 2.0;  // scatter of the first half over that of the second half
constexpr double kMaxProbability = 1e-3;
constexpr double kRoundingOfMotion = 1e-6;  // relative; the scatter of noise-free records
constexpr std::size_t kMaxNoiseHarmonics = 64;
constexpr std::size_t kMinCyclesInDoubt = 4, kMinPointsInDoubt = 8;
constexpr Eigen::Index kMaxHarmonics = 16;  // that show a transient

// The cycles without a pattern that repeats after `periods` of them.
struct BesidePattern {
  std::vector<double> y;
  double squares = 0.0;
};
BesidePattern beside_pattern(const Cycles& cycles, int periods) {
  const std::size_t n = cycles.points;
  const auto courses = CycleCourses::repeating(cycles.count(), periods);
  BesidePattern beside{cycles.y, 0.0};
  std::vector<double> values(cycles.count());
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < values.size(); ++k)
      values[k] = cycles.y[k * n + i];
    beside.squares += courses.take_out(values).rest;
    for (std::size_t k = 0; k < values.size(); ++k)
      beside.y[k * n + i] = values[k];
  }
  return beside;
}

double root_mean_square_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values)
    sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

// The standard deviation of white noise: its energy is equal in all harmonics of a cycle, so
// the median over the harmonics gives it.
double white_part(const std::vector<double>& rest, std::size_t n) {
  const std::size_t last = std::min(kMaxNoiseHarmonics, (n - 1) / 2);
  std::vector<double> energy, cosine(n), sine(n);
  for (std::size_t h = 1; h <= last; ++h) {
    for (std::size_t i = 0; i < n; ++i) {
      cosine[i] =
          harmonic_term(static_cast<int>(2 * h - 1), static_cast<int>(i), static_cast<int>(n));
      sine[i] = harmonic_term(static_cast<int>(2 * h), static_cast<int>(i), static_cast<int>(n));
    }
    double sum = 0.0;
    for (std::size_t begin = 0; begin + n <= rest.size(); begin += n) {
      double c = 0.0, s = 0.0;
      for (std::size_t i = 0; i < n; ++i) {
        c += rest[begin + i] * cosine[i];
        s += rest[begin + i] * sine[i];
      }
      sum += c * c + s * s;
    }
    energy.push_back(sum / static_cast<double>(rest.size()));  // the variance of white noise
  }
  const auto middle = energy.begin() + static_cast<std::ptrdiff_t>(energy.size() / 2);
  std::nth_element(energy.begin(), middle, energy.end());
  return std::sqrt(*middle);
}

double motion_of(const Cycles& cycles) {
  double mean = 0.0;
  for (const double y : cycles.y)
    mean += y / static_cast<double>(cycles.y.size());
  std::vector<double> off = cycles.y;
  for (double& y : off)
    y -= mean;
  return root_mean_square_of(off);
}

Cycles part_of(const Cycles& cycles, std::size_t first, std::size_t count) {
  const auto begin = cycles.y.begin() + static_cast<std::ptrdiff_t>(first * cycles.points);
  return {{begin, begin + static_cast<std::ptrdiff_t>(count * cycles.points)}, cycles.points};
}

double scatter_above_rounding(const Cycles& cycles, int periods) {
  return std::max(scatter_after(cycles, periods), kRoundingOfMotion * motion_of(cycles));
}

// The smallest number of periods after which the record repeats as well as after any number.
int best_period(const Cycles& cycles) {
  double least = std::numeric_limits<double>::infinity();
  for (int p = 1; p <= kLongestRepetition; ++p)
    least = std::min(least, scatter_above_rounding(cycles, p));
  for (int p = 1; p < kLongestRepetition; ++p) {
    if (scatter_above_rounding(cycles, p) <= kScatterRatio * least) return p;
  }
  return kLongestRepetition;
}

// The probability that noise alone makes cycles `from` periods apart differ by so much more
// than cycles `to` periods apart. `numbers`: independent values in a cycle.
double chance_of_gain(const Cycles& cycles, int from, int to, double numbers) {
  const double within = static_cast<double>(cycles.count()) - to;
  const double close = beside_pattern(cycles, to).squares;
  const double rounding = kRoundingOfMotion * motion_of(cycles);
  return probability_by_chance({beside_pattern(cycles, from).squares - close, close},
                               numbers * (to - from), numbers * within,
                               rounding * rounding * static_cast<double>(cycles.points) / numbers);
}

// The same test with one independent value in a cycle, because noise that drifts slowly has no
// more.
bool gains(const Cycles& cycles, int from, int to) {
  const int part = to % from == 0 ? from : 1;
  return to > part && chance_of_gain(cycles, part, to, 1.0) < kMaxProbability;
}

bool still_settles(const Cycles& cycles, int periods) {
  const std::size_t half = cycles.count() / 2;
  return half >= static_cast<std::size_t>(2 * periods) &&
         scatter_above_rounding(part_of(cycles, 0, half), periods) >
             kSettlingRatio *
                 scatter_above_rounding(part_of(cycles, cycles.count() - half, half), periods);
}

// A row for each cycle: its Fourier sums. Their size does not matter to the test of the transient.
Eigen::MatrixXd harmonics_of(const Cycles& cycles) {
  const auto n = static_cast<Eigen::Index>(cycles.points);
  const Eigen::Index terms = 2 * std::min(kMaxHarmonics, (n - 1) / 2) + 1;
  Eigen::MatrixXd basis(n, terms);
  for (int i = 0; i < n; ++i) {
    for (int term = 0; term < terms; ++term)
      basis(i, term) = harmonic_term(term, i, static_cast<int>(n));
  }
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const Rows>(cycles.y.data(), static_cast<Eigen::Index>(cycles.count()), n) *
         basis;
}

}  // namespace

double scatter_after(const Cycles& cycles, int periods) {
  const auto p = static_cast<std::size_t>(periods);
  const std::size_t count = cycles.count();
  if (count < 2 * p) return std::numeric_limits<double>::infinity();
  return std::sqrt(beside_pattern(cycles, periods).squares /
                   static_cast<double>(cycles.points * (count - p)));
}

RepetitionFinding find_repetition(const Cycles& cycles, int periods) {
  RepetitionFinding found;
  found.kind = Repetition::too_few;
  if (cycles.count() < 2 * static_cast<std::size_t>(periods)) return found;
  found.scatter = scatter_above_rounding(cycles, periods);
  found.best = best_period(cycles);
  found.best_scatter = scatter_above_rounding(cycles, found.best);
  found.kind = Repetition::other_period;
  if (kScatterRatio * found.best_scatter < found.scatter && gains(cycles, periods, found.best))
    return found;
  found.noise = white_part(beside_pattern(cycles, periods).y, cycles.points);
  if (found.scatter > kMaxOverNoise * found.noise &&
      found.scatter > kMaxOfMotion * motion_of(cycles))
    found.kind = still_settles(cycles, periods) ? Repetition::settles : Repetition::never;
  else if (chance_of_gain(cycles, 1, periods, static_cast<double>(cycles.points)) > kMaxProbability)
    found.kind = Repetition::every_period;
  else
    found.kind = Repetition::repeats;
  return found;
}

Alternation find_alternation(const Cycles& cycles) {
  if (cycles.count() < kMinCyclesInDoubt || cycles.points < kMinPointsInDoubt) return {};
  const int best = best_period(cycles);
  const double scatter = scatter_above_rounding(cycles, best);
  if (!gains(cycles, 1, best)) return {};
  const double all = scatter_above_rounding(cycles, 1);
  // The difference of two neighbouring cycles, relative to that of two cycles that should be
  // alike.
  const double between = std::max(0.0, all * all - scatter * scatter) * best / (best - 1.0);
  return {best, std::sqrt(between) / scatter,
          std::sqrt(between) > kMaxOfMotion * motion_of(cycles)};
}

Cycles steady_groups(Cycles cycles, int periods) {
  const auto m = static_cast<std::size_t>(periods);
  const std::size_t count = cycles.count();
  if (count > m) cycles = part_of(cycles, count % m, count - count % m);
  if (count < 2 * m) return cycles;
  const auto transient = cycles_of_transient(harmonics_of({cycles.y, cycles.points * m}));
  const std::size_t first = m * static_cast<std::size_t>(transient);
  return part_of(cycles, first, cycles.count() - first);
}

}  // namespace shaker::estimator
