// Follows the phase of the excitation through a dwell: the turn at any time, and the time of
// any turn.
//
// The rig's oscillator differs from ours (200 ppm are usual). Therefore the phase comes from
// the motion of the table, one observation per period, and a straight line through the last 32
// of them gives phase and frequency. With 1000 samples a period and noise of 1/600 of the
// amplitude the frequency is accurate to 0.2 ppm and the phase to 2e-6 turns
// (tests/daemon/cycles/phase_tracker_test.cpp checks these figures). A jump of the phase (the
// drive re-synchronised) restarts the line.
//
// One thread; never allocates.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/clock.hpp"

namespace shaker::daemon {

class PhaseTracker {
 public:
  static constexpr std::size_t kWindow = 32;

  // Clears all observations. The nominal frequency must be right to a quarter of a turn per
  // period.
  void restart(double nominal_hz);

  // Adds an observation: at `t` the fundamental is `turns` after its positive peak; the whole
  // part of `turns` does not matter.
  void add(Nanoseconds t, double turns);
  // Replaces an observation by a new fit; `back` observations are newer. Precondition: back <
  // observations().
  void revise(std::size_t back, double turns);

  bool locked() const { return count_ >= 2; }
  bool started() const { return count_ >= 1; }
  std::size_t observations() const { return count_; }  // number in the line
  double frequency_hz() const { return frequency_; }
  double turns_at(Nanoseconds t) const;     // unwrapped; precondition: started()
  Nanoseconds time_of(double turns) const;  // the inverse of turns_at
  // Scatter of the observations about the line, turns; 0 with fewer than three.
  double scatter() const { return scatter_; }
  long jumps() const { return jumps_; }

 private:
  void fit();

  struct Observation {
    double t = 0.0, turns = 0.0;  // seconds from origin_
  };
  std::array<Observation, kWindow> window_{};
  std::size_t count_ = 0, next_ = 0;
  Nanoseconds origin_{};
  double frequency_ = 0.0;
  double mean_t_ = 0.0, mean_turns_ = 0.0, scatter_ = 0.0;
  long jumps_ = 0;
};

}  // namespace shaker::daemon
