#include "cli/repetition.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "estimator/math/statistics.hpp"

namespace shaker::cli {
namespace {

constexpr int kLongest = 4;  // longest period that is searched for, as in the daemon's gate
// Threshold of a ratio of scatters: cycles that alternate by twice the noise of their
// difference reach it. Weaker alternation changes a mean cycle only by its square, which is
// below the noise.
const double kTelling = std::sqrt(3.0);
constexpr double kNotNoise = 3.0;   // scatter over white noise; slow drift of a rig reaches 2
constexpr double kOfMotion = 0.02;  // relative to the motion; below it is the drift of a rig
constexpr double kSettles = 2.0;    // scatter of the first half over that of the second half
constexpr double kProbability = 1e-3;
constexpr double kRounding = 1e-6;  // relative to the motion; the scatter of noise-free records
constexpr std::size_t kMostHarmonics = 64;

// The residual of each cycle: the cycle minus the mean of the cycles that are `periods` apart.
std::vector<double> residual_of(const Cycles& cycles, int periods) {
  const auto p = static_cast<std::size_t>(periods);
  const std::size_t n = cycles.points, count = cycles.count();
  std::vector<double> mean(p * n, 0.0), rest(cycles.y);
  for (std::size_t i = 0; i < count * n; ++i)
    mean[i % (p * n)] += cycles.y[i];
  for (std::size_t i = 0; i < count * n; ++i) {
    const std::size_t of = i % (p * n) / n;
    rest[i] -= mean[i % (p * n)] / static_cast<double>((count - of + p - 1) / p);
  }
  return rest;
}

double root_mean_square(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values)
    sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

// The standard deviation of white noise: its energy is equal in all harmonics of a cycle, so
// the median over the harmonics gives it.
double white_part(const std::vector<double>& rest, std::size_t n) {
  const std::size_t last = std::min(kMostHarmonics, (n - 1) / 2);
  std::vector<double> energy;
  for (std::size_t h = 1; h <= last; ++h) {
    double sum = 0.0;
    for (std::size_t begin = 0; begin + n <= rest.size(); begin += n) {
      double c = 0.0, s = 0.0;
      for (std::size_t i = 0; i < n; ++i) {
        const double angle =
            2.0 * std::numbers::pi * static_cast<double>(h * i % n) / static_cast<double>(n);
        c += rest[begin + i] * std::cos(angle);
        s += rest[begin + i] * std::sin(angle);
      }
      sum += c * c + s * s;
    }
    energy.push_back(sum / static_cast<double>(rest.size()));  // the variance of white noise
  }
  const auto middle = energy.begin() + static_cast<std::ptrdiff_t>(energy.size() / 2);
  std::nth_element(energy.begin(), middle, energy.end());
  return std::sqrt(*middle);
}

double motion(const Cycles& cycles) {
  double mean = 0.0;
  for (const double y : cycles.y)
    mean += y / static_cast<double>(cycles.y.size());
  double sum = 0.0;
  for (const double y : cycles.y)
    sum += (y - mean) * (y - mean);
  return std::sqrt(sum / static_cast<double>(cycles.y.size()));
}

Cycles part(const Cycles& cycles, std::size_t first, std::size_t count) {
  const auto begin = cycles.y.begin() + static_cast<std::ptrdiff_t>(first * cycles.points);
  return {{begin, begin + static_cast<std::ptrdiff_t>(count * cycles.points)}, cycles.points};
}

double noticed(const Cycles& cycles, int periods) {
  return std::max(scatter_after(cycles, periods), kRounding * motion(cycles));
}

// The smallest number of periods after which the record repeats as well as after any number.
int best_period(const Cycles& cycles) {
  double least = std::numeric_limits<double>::infinity();
  for (int p = 1; p <= kLongest; ++p)
    least = std::min(least, noticed(cycles, p));
  for (int p = 1; p < kLongest; ++p) {
    if (noticed(cycles, p) <= kTelling * least) return p;
  }
  return kLongest;
}

// The probability that noise alone makes cycles `from` periods apart differ by so much more
// than cycles `to` periods apart. `numbers`: independent values in a cycle.
double chance_of_gain(const Cycles& cycles, int from, int to, double numbers) {
  const auto count = static_cast<double>(cycles.count());
  const double wide = noticed(cycles, from), close = noticed(cycles, to);
  const double within = count - to, between = to - from;
  const double gained = wide * wide * (count - from) - close * close * within;
  return estimator::fisher_f_above(std::max(gained, 0.0) / between / (close * close),
                                   numbers * between, numbers * within);
}

// The same test with one independent value in a cycle, because noise that drifts slowly has no
// more.
bool gains(const Cycles& cycles, int from, int to) {
  const int part = to % from == 0 ? from : 1;
  return to > part && chance_of_gain(cycles, part, to, 1.0) < kProbability;
}

std::string remedy(int periods, const std::string& run) {
  if (periods > kMostPeriods)
    return fmt::format("no more than {} periods can be fitted", kMostPeriods);
  if (run.empty() && periods == 1) return "leave --periods out";
  return fmt::format("say --periods {}{}", run.empty() ? "" : run + "=", periods);
}

std::string no_repetition(const Cycles& cycles, int periods, double noise) {
  const std::size_t half = cycles.count() / 2;
  const auto two = static_cast<std::size_t>(2 * periods);
  const double scatter = noticed(cycles, periods);
  const std::string how = fmt::format(
      "it does not repeat after {} periods: cycles so far apart differ by {:.3g}, {:.0f} "
      "times the noise",
      periods, scatter * std::numbers::sqrt2, scatter / noise);
  if (half >= two && noticed(part(cycles, 0, half), periods) >
                         kSettles * noticed(part(cycles, cycles.count() - half, half), periods))
    return how + "; it still settles: leave its first cycles out";
  return how + fmt::format(
                   "; nor does it after 1 to {} others. What never repeats can be followed "
                   "in time, a piece of it, with --transient",
                   kLongest);
}

}  // namespace

double scatter_after(const Cycles& cycles, int periods) {
  const auto p = static_cast<std::size_t>(periods);
  const std::size_t count = cycles.count();
  if (count < 2 * p) return std::numeric_limits<double>::infinity();
  const auto all = static_cast<double>(count);
  return root_mean_square(residual_of(cycles, periods)) * std::sqrt(all / (all - periods));
}

Result<void> check_repetition(const Cycles& cycles, int periods, const std::string& place,
                              const std::string& run) {
  const auto bad = [&](const std::string& why) {
    return Error{ErrorKind::invalid, fmt::format("{}: {}", place, why)};
  };
  const std::size_t count = cycles.count();
  if (count < 2 * static_cast<std::size_t>(periods))
    return bad(
        fmt::format("{} whole cycle{}; with --periods {} at least {} are needed, so that it "
                    "can be seen to repeat",
                    count, count == 1 ? "" : "s", periods, 2 * periods));
  const double scatter = noticed(cycles, periods);
  const int best = best_period(cycles);
  if (kTelling * noticed(cycles, best) < scatter && gains(cycles, periods, best))
    return bad(fmt::format(
        "it does not repeat after {} periods but after {}: cycles {} apart differ {:.1f} times as "
        "much as cycles {} apart; {}",
        periods, best, periods, scatter / noticed(cycles, best), best, remedy(best, run)));
  const double noise = white_part(residual_of(cycles, periods), cycles.points);
  if (scatter > kNotNoise * noise && scatter > kOfMotion * motion(cycles))
    return bad(no_repetition(cycles, periods, noise));
  if (chance_of_gain(cycles, 1, periods, static_cast<double>(cycles.points)) > kProbability)
    return bad(
        fmt::format("it repeats after every period: cycles next to each other do not differ "
                    "by more than noise; {}",
                    remedy(1, run)));
  return {};
}

RepetitionDoubt doubt_of_repetition(const Cycles& cycles, const std::string& place,
                                    const std::string& run) {
  if (cycles.count() < 4 || cycles.points < 8) return {};
  const int best = best_period(cycles);
  const double scatter = noticed(cycles, best);
  if (!gains(cycles, 1, best)) return {};
  const double all = noticed(cycles, 1);
  // The difference of two neighbouring cycles, relative to that of two cycles that should be
  // alike.
  const double between = std::max(0.0, all * all - scatter * scatter) * best / (best - 1.0);
  const double difference = std::sqrt(between) / scatter;
  const std::string how =
      best == 2 ? fmt::format(
                      "its cycles alternate: odd and even ones differ by {:.0f} times the "
                      "noise",
                      difference)
                : fmt::format(
                      "its cycles repeat only after {} periods of the excitation: those in "
                      "between differ by {:.0f} times the noise",
                      best, difference);
  return {fmt::format("{}: {}, so that their mean is no motion of the damper; {}", place, how,
                      remedy(best, run)),
          std::sqrt(between) > kOfMotion * motion(cycles)};
}

}  // namespace shaker::cli
