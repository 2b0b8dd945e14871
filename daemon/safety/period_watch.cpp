#include "daemon/safety/period_watch.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace shaker::daemon {
namespace {

constexpr double kLeastSpread = 1e-3;  // of samples over the phases; 1/4 where they fill the period
constexpr double kFewest = 0.8;        // of a period's samples, required to judge it
constexpr double kGapPart = 0.1;       // of a period may lack samples where it is compared
constexpr double kGapSamples = 2.5;    // intervals between samples are no gap

}  // namespace

bool PeriodFigures::filled(double rate_hz) const {
  return samples >= kFewest * rate_hz * seconds(end - begin);
}

bool PeriodFigures::whole(double rate_hz) const {
  return longest_gap_s <= std::max(kGapPart * seconds(end - begin), kGapSamples / rate_hz);
}

void PeriodWatch::restart(double frequency_hz, Nanoseconds t) {
  *this = {};
  frequency_hz_ = frequency_hz;
  grid_ = last_ = t;
}

Nanoseconds PeriodWatch::begin_of(long index) const {
  return grid_ + from_seconds(static_cast<double>(index) / frequency_hz_);
}

std::optional<PeriodFigures> PeriodWatch::add(Nanoseconds t, double value) {
  if (frequency_hz_ <= 0.0 || t < grid_) return std::nullopt;
  const double turns = frequency_hz_ * seconds(t - grid_);
  const long index = static_cast<long>(turns);
  std::optional<PeriodFigures> done;
  if (index != index_) {
    if (count_ > 0) done = close();
    index_ = index;
    last_ = std::max(last_, begin_of(index));
    longest_gap_ = Nanoseconds{0};
    count_ = 0;
    first_ = value;
    sum_ = square_ = 0.0;
    turned_ = turns_ = double_turns_ = 0.0;
  }
  longest_gap_ = std::max(longest_gap_, t - last_);
  last_ = t;
  const double v = value - first_;
  const auto back = std::polar(1.0, -2.0 * std::numbers::pi * turns);
  ++count_;
  sum_ += v;
  square_ += v * v;
  turned_ += v * back;
  turns_ += back;
  double_turns_ += back * back;
  return done;
}

// Least squares of mean, cosine and sine: the samples need not fill the period evenly. A mere
// projection of a sine that lacks a fifth of its period is wrong by up to 30 %.
std::complex<double> PeriodWatch::fitted() const {
  const double n = count_;
  const std::complex<double> mean_turn = turns_ / n;
  const double cosine = mean_turn.real(), sine = -mean_turn.imag();
  const double cos_cos = 0.5 * (1.0 + double_turns_.real() / n) - cosine * cosine;
  const double sin_sin = 0.5 * (1.0 - double_turns_.real() / n) - sine * sine;
  const double cos_sin = -0.5 * double_turns_.imag() / n - cosine * sine;
  const double spread = cos_cos * sin_sin - cos_sin * cos_sin;
  const std::complex<double> projected = (turned_ - sum_ * mean_turn) / n;
  if (spread < kLeastSpread) return 2.0 * projected;
  const double with_cos = projected.real(), with_sin = -projected.imag();
  return {(with_cos * sin_sin - with_sin * cos_sin) / spread,
          -(with_sin * cos_cos - with_cos * cos_sin) / spread};
}

PeriodFigures PeriodWatch::close() {
  const double n = count_, mean = sum_ / n;
  PeriodFigures figures;
  figures.index = index_;
  figures.begin = begin_of(index_);
  figures.end = begin_of(index_ + 1);
  figures.samples = count_;
  figures.longest_gap_s = seconds(std::max(longest_gap_, figures.end - last_));
  figures.fundamental = fitted();
  figures.all = std::sqrt(2.0 * std::max(0.0, square_ / n - mean * mean));
  return figures;
}

}  // namespace shaker::daemon
