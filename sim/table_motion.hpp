// What the table does: x(t) = A(t) cos(phase(t)), frequency and amplitude on linear ramps.
//
// The phase is the integral of the frequency, so it never jumps while the table moves; it starts at
// zero when the table starts from rest. Times are seconds on our clock; the rig's own oscillator
// runs `rate` times as fast (1 + ppm 1e-6), and everything here follows it.
#pragma once

#include <array>

namespace shaker::sim {

class TableMotion {
 public:
  // Harmonics 2..5 as fractions of the fundamental, in phase with it at its crest.
  explicit TableMotion(double rate = 1.0, std::array<double, 4> harmonics = {});

  // From what it does at t linearly to the new frequency and amplitude in `ramp` seconds.
  void go_to(double t, double frequency_hz, double amplitude, double ramp);
  void stop(double t) { go_to(t, target_frequency(), 0.0, 0.0); }

  // Upward acceleration, m/s^2; defined from the last go_to on.
  double acceleration(double t) const;
  double fundamental(double t, double lag = 0.0) const;  // of which the part without harmonics
  // Its integrals without a constant, m/s and m: exact while frequency and amplitude stand, and on
  // the ramps what a transducer that cannot measure a standing offset would say. 0 at rest.
  double velocity(double t) const;
  double position(double t) const;
  double phase(double t) const;  // rad
  double frequency(double t) const;
  double amplitude(double t) const;
  double target_frequency() const { return f1_; }
  double target_amplitude() const { return a1_; }

 private:
  double elapsed(double t) const { return (t - t0_) * rate_; }

  double rate_;
  std::array<double, 4> harmonics_;
  bool pure_;
  double t0_ = 0.0, ramp_ = 0.0;
  double phase0_ = 0.0, f0_ = 0.0, f1_ = 0.0, a0_ = 0.0, a1_ = 0.0;
};

}  // namespace shaker::sim
