#include "daemon/safety/period_watch.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace shaker::daemon {

void PeriodWatch::restart(double frequency_hz, Nanoseconds t) {
  *this = {};
  frequency_hz_ = frequency_hz;
  grid_ = t;
}

std::optional<PeriodFigures> PeriodWatch::add(Nanoseconds t, double value) {
  if (frequency_hz_ <= 0.0 || t < grid_) return std::nullopt;
  const double turns = frequency_hz_ * seconds(t - grid_);
  const long index = static_cast<long>(turns);
  std::optional<PeriodFigures> done;
  if (index != index_) {
    if (count_ > 0) done = close();
    index_ = index;
    count_ = 0;
    first_ = value;
    sum_ = square_ = 0.0;
    turned_ = turns_ = 0.0;
  }
  const double v = value - first_;
  const auto back = std::polar(1.0, -2.0 * std::numbers::pi * turns);
  ++count_;
  sum_ += v;
  square_ += v * v;
  turned_ += v * back;
  turns_ += back;
  return done;
}

// Subtracts the mean first, because the samples need not fill the period evenly.
PeriodFigures PeriodWatch::close() {
  const double n = count_, mean = sum_ / n;
  PeriodFigures figures;
  figures.index = index_;
  figures.begin = grid_ + from_seconds(static_cast<double>(index_) / frequency_hz_);
  figures.end = grid_ + from_seconds(static_cast<double>(index_ + 1) / frequency_hz_);
  figures.samples = count_;
  figures.fundamental = 2.0 / n * (turned_ - mean * turns_);
  figures.all = std::sqrt(2.0 * std::max(0.0, square_ / n - mean * mean));
  return figures;
}

}  // namespace shaker::daemon
