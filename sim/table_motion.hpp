// The motion of the table: x(t) = A(t) cos(phase(t)), where frequency and amplitude follow
// linear ramps.
//
// The phase is the integral of the frequency, so it never jumps while the table moves; it
// starts at zero when the table starts from rest. Times are seconds on the host's clock. The
// rig's own oscillator runs `rate` times as fast (1 + ppm 1e-6), and frequencies and ramps
// follow it.
#pragma once

#include <array>

namespace shaker::sim {

class TableMotion {
 public:
  // harmonics: the 2nd to the 5th as fractions of the fundamental; each has its crest at the
  // fundamental's crest.
  // gain: of the motion over what amplitude() says, growing by `drift` of itself in each second.
  explicit TableMotion(double rate = 1.0, std::array<double, 4> harmonics = {}, double gain = 1.0,
                       double drift = 0.0);

  // Starts at time t a linear ramp from the present to the new frequency (Hz) and amplitude
  // (m/s^2), which takes `ramp` seconds of the rig's clock.
  void go_to(double t, double frequency_hz, double amplitude, double ramp);
  void stop(double t) { go_to(t, target_frequency(), 0.0, 0.0); }

  // The upward acceleration, m/s^2. Valid from the time of the last go_to on.
  double acceleration(double t) const;
  double fundamental(double t, double lag = 0.0) const;  // without the harmonics; lag in rad
  // The integrals of the acceleration without a constant, m/s and m. They are exact while
  // frequency and amplitude are constant. On a ramp they are what a transducer that blocks a
  // constant offset would give. 0 at rest.
  double velocity(double t) const;
  double position(double t) const;
  double phase(double t) const;  // rad
  // Frequency (Hz of the rig's clock) and amplitude (m/s^2) at time t, on the ramp, as the
  // controller has them: without the gain.
  double frequency(double t) const;
  double amplitude(double t) const;
  double target_frequency() const { return f1_; }
  double target_amplitude() const { return a1_; }

 private:
  double elapsed(double t) const { return (t - t0_) * rate_; }
  double moved(double t) const { return amplitude(t) * gain_ * (1.0 + drift_ * t); }

  double rate_;
  std::array<double, 4> harmonics_;
  bool pure_;
  double gain_, drift_;
  double t0_ = 0.0, ramp_ = 0.0;
  double phase0_ = 0.0, f0_ = 0.0, f1_ = 0.0, a0_ = 0.0, a1_ = 0.0;
};

}  // namespace shaker::sim
