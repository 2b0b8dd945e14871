// Figures of a channel in each period of the setpoint, in every state with a commanded motion,
// even if no cycle can be cut: the amplitude at the commanded frequency, and that of the whole
// motion.
//
// Periods follow each other on the grid of the setpoint, from the time of its order. One
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
  double longest_gap_s = 0.0;        // within the period, between samples or to its ends
  std::complex<double> fundamental;  // at the commanded frequency, phase on the grid
  double all = 0.0;                  // sqrt(2) times the standard deviation

  // Can the period be judged, of a channel with `rate_hz` samples a second?
  bool filled(double rate_hz) const;
  // Can it be compared with other periods? A gap falsifies the phase where stamps are late.
  bool whole(double rate_hz) const;
};

class PeriodWatch {
 public:
  void restart(double frequency_hz, Nanoseconds t);
  // Takes one good sample; times ascend. With the first sample after a period, returns its
  // figures.
  std::optional<PeriodFigures> add(Nanoseconds t, double value);

 private:
  PeriodFigures close();
  std::complex<double> fitted() const;
  Nanoseconds begin_of(long index) const;

  double frequency_hz_ = 0.0;
  Nanoseconds grid_{}, last_{}, longest_gap_{};
  long index_ = -1;
  int count_ = 0;
  double first_ = 0.0, sum_ = 0.0, square_ = 0.0;
  std::complex<double> turned_, turns_, double_turns_;
};

}  // namespace shaker::daemon
