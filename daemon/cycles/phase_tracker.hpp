// The excitation's own phase, followed through a dwell: which turn it is at any time, and when a
// turn begins.
//
// The rig's oscillator is not ours (200 ppm are usual), so the phase is taken from what the table
// does, one observation per period, and a straight line through the last 32 of them gives phase and
// frequency. With 1000 samples a period and noise of 1/600 of the amplitude the frequency is good
// to 0.2 ppm and the phase to 2e-6 turns (tests/daemon/cycles/phase_tracker_test.cpp holds the
// figures). A phase that jumps (the drive re-synchronised) restarts the line instead of bending it.
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

  // Forgets everything. The nominal frequency must be right to a quarter of a turn per period.
  void restart(double nominal_hz);

  // One observation: at `t` the fundamental stands `turns` after its positive peak (any whole
  // part).
  void add(Nanoseconds t, double turns);
  // The observation before `back` others was fitted again, and is this. Precondition: back <
  // observations().
  void revise(std::size_t back, double turns);

  bool locked() const { return count_ >= 2; }
  bool started() const { return count_ >= 1; }
  std::size_t observations() const { return count_; }  // in the line
  double frequency_hz() const { return frequency_; }
  double turns_at(Nanoseconds t) const;     // unwrapped; precondition: started()
  Nanoseconds time_of(double turns) const;  // its inverse
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
