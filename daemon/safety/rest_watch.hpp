// Detects motion of a channel that should rest.
//
// Takes samples together over 10 ms and examines the last 0.4 s. The channel moves if in a fifth of
// that time the samples lie further from the mean, by their root mean square, than five times the
// noise at rest. A single wrong sample is not a motion; a sinusoid of that size is, however fast.
// One thread; add() neither allocates nor blocks.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "base/clock.hpp"

namespace shaker::daemon {

class RestWatch {
 public:
  // Sets the standard deviation of a sample at rest, in the channel's unit. If it is unset or
  // zero, no motion is detected.
  void learn(double noise) { limit_ = kTimesNoise * noise; }
  bool knows_rest() const { return limit_ > 0.0; }

  // Takes one good sample; times ascend.
  void add(Nanoseconds t, double value);

  bool moves() const { return moves_; }
  // True if the whole window lies after `t`, so that moves() describes the time since `t`.
  bool covers_since(Nanoseconds t) const { return filled_ == kBins && oldest_ >= t; }
  double level() const { return level_; }  // root mean square about the mean, in the window

 private:
  static constexpr double kTimesNoise = 5.0;
  static constexpr std::size_t kBins = 40;
  static constexpr std::size_t kMovingBins = kBins / 5;

  void close_bin();

  // About the first sample of all: a mean far from zero costs no digits.
  struct Bin {
    double mean = 0.0, square = 0.0;
  };

  double limit_ = 0.0, sum_ = 0.0, square_ = 0.0, level_ = 0.0;
  int count_ = 0;
  Nanoseconds bin_begin_{}, oldest_{};
  std::optional<double> origin_;
  std::array<Bin, kBins> bins_{};
  std::array<Nanoseconds, kBins> begins_{};
  std::size_t next_ = 0, filled_ = 0;
  bool moves_ = false;
};

}  // namespace shaker::daemon
