#include "daemon/safety/frequency_watch.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace shaker::daemon {
namespace {

constexpr double kTurn = 0.01;    // turns between two looks: 2 % of the frequency
constexpr double kStampS = 2e-3;  // s by which the stamps of a loaded machine may drift meanwhile
constexpr double kSigmas = 5.0;   // of the noise of a phase
constexpr double kEither = 0.2;   // turns beyond which a direction is ambiguous
constexpr double kSmall = 0.5;    // fundamental over the whole motion: most lies elsewhere
constexpr double kClear = 5.0;    // times the least amplitude: disturbances are small beside it

}  // namespace

void FrequencyWatch::restart(double frequency_hz, Nanoseconds t) {
  frequency_hz_ = frequency_hz;
  whole_.restart(frequency_hz, t);
  // A proof of the dead-man at rest has no frequency, and no periods.
  halves_.restart(frequency_hz, frequency_hz > 0.0 ? t + from_seconds(0.5 / frequency_hz) : t);
  forget();
}

void FrequencyWatch::forget() {
  known_ = false;
  in_a_row_ = 0;
}

void FrequencyWatch::add(Nanoseconds t, double value, const Sight& sight) {
  if (const auto figures = whole_.add(t, value)) look(*figures, figures->fundamental, sight);
  if (const auto figures = halves_.add(t, value)) look(*figures, -figures->fundamental, sight);
}

void FrequencyWatch::look(const PeriodFigures& figures, std::complex<double> fundamental,
                          const Sight& sight) {
  const double still = sight.noise * std::sqrt(2.0 / figures.samples);
  const double all =
      std::sqrt(std::max(0.0, std::pow(figures.all, 2) - 2.0 * std::pow(sight.noise, 2)));
  if (!figures.filled(sight.rate_hz) || !figures.whole(sight.rate_hz) ||
      all < sight.least + kSigmas * still)
    return forget();
  const double amplitude = std::abs(fundamental);
  near_ = amplitude > kSmall * all || all < kClear * sight.least;
  const double turn =
      known_ ? std::arg(fundamental * std::conj(last_)) / (2.0 * std::numbers::pi) : 0.0;
  const double most = std::max(
      {kTurn, kStampS * frequency_hz_, kSigmas * still / (2.0 * std::numbers::pi * amplitude)});
  const bool turns = std::abs(turn) > most;
  const bool onwards = in_a_row_ == 0 || turn * turn_ > 0.0 || std::abs(turn) > kEither;
  if (!near_ || (turns && onwards))
    ++in_a_row_;
  else
    in_a_row_ = turns ? 1 : 0;
  turn_ = turn;
  last_ = fundamental;
  known_ = true;
}

double FrequencyWatch::frequency_hz() const {
  return near_ && std::abs(turn_) < kEither ? frequency_hz_ * (1.0 + 2.0 * turn_) : 0.0;
}

}  // namespace shaker::daemon
