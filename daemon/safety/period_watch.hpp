// What a channel does in each period of the setpoint, in every state in which something is
// commanded, whether or not a cycle can be cut: its amplitude at the commanded frequency, and that
// of all it does.
//
// Periods follow each other on the grid of the setpoint, from the moment it was ordered. One
// thread; add() neither allocates nor blocks.
#pragma once

#include <complex>
#include <optional>

#include "base/clock.hpp"

namespace shaker::daemon {

struct PeriodFigures {
  long index = 0;  // of the period
  Nanoseconds begin{}, end{};
  int samples = 0;
  std::complex<double> fundamental;  // at the commanded frequency, phase on the grid
  double all = 0.0;  // sqrt(2) times the standard deviation: the same for a sinusoid
};

class PeriodWatch {
 public:
  void restart(double frequency_hz, Nanoseconds t);
  // One good sample, in order of time. What a period did, with the first sample after it.
  std::optional<PeriodFigures> add(Nanoseconds t, double value);

 private:
  PeriodFigures close();

  double frequency_hz_ = 0.0;
  Nanoseconds grid_{};
  long index_ = -1;
  int count_ = 0;
  double first_ = 0.0, sum_ = 0.0, square_ = 0.0;
  std::complex<double> turned_, turns_;
};

}  // namespace shaker::daemon
