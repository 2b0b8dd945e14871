// From samples to whole periods of the excitation.
//
// tau = 0 is the positive peak of the excitation's fundamental. Where an excitation channel is
// measured its phase is followed period by period (PhaseTracker) and the cycle's excitation is
// given as its fundamental with harmonics 2 to 5, at the phase that it had in this cycle (a phase
// that wanders is followed by the line some cycles late), without a mean: a table does not
// accelerate on average, so a mean is the accelerometer's offset, and what lies above the fifth
// harmonic is mostly noise. Where it is not measured, the frequency comes from the stroke's own
// fundamental and tau = 0 from the commanded phase, which knows nothing of the drive's delay:
// damping is then biased, and the engine says so with every estimate.
//
// Stamps may wander (a kernel's receive time) or be right about a sampling that wanders itself.
// Each cycle is resampled with the stamps as they are and put back onto a regular clock, and the
// one with the smaller residual is kept.
//
// push() does not allocate and costs some nanoseconds; poll() does the work once a period. One
// thread.
#pragma once

#include <string>
#include <vector>

#include "base/clock.hpp"
#include "daemon/cycles/channel_buffer.hpp"
#include "daemon/cycles/harmonic_fit.hpp"
#include "daemon/cycles/phase_tracker.hpp"
#include "estimator/measured_cycle.hpp"
#include "protocol/channel.hpp"

namespace shaker::daemon {

struct CycleOptions {
  int points = 64;
  double nominal_hz = 1.0;
  double sample_rate_hz = 1000.0;      // of the displacement
  double excitation_rate_hz = 1000.0;  // both size the memory
  bool excitation_measured = true;
};

struct AssembledCycle {
  estimator::MeasuredCycle measured;  // run and index are the caller's to fill
  bool whole = false;
  std::string why;            // when not whole
  Nanoseconds last_sample{};  // stamp of the last sample that it needed
  long samples = 0;           // of the displacement
  int gaps = 0;               // places where samples are missing
  double longest_gap_s = 0.0;
  double jitter_fraction = 0.0;                  // of the stamps about a regular clock, of a sample
  double sample_noise = 0.0, point_noise = 0.0;  // m
  double stroke_min = 0.0, stroke_max = 0.0;     // of the points
  double excitation_noise = 0.0;                 // m/s^2, of one sample
  double lag_turns = 0.0;         // of the stroke's fundamental behind the excitation's, 0..1
  double stroke_amplitude = 0.0;  // of its fundamental
};

class CycleAssembler {
 public:
  // Allocates. Cycles begin after `from`.
  void restart(const CycleOptions& options, Nanoseconds from);
  void push(protocol::Channel channel, Nanoseconds t, double value);
  // The next whole period once its samples are there, or null. Valid until the next call.
  const AssembledCycle* poll();

  double frequency_hz() const { return tracker_.frequency_hz(); }
  const PhaseTracker& tracker() const { return tracker_; }

 private:
  const ChannelBuffer& reference() const {
    return options_.excitation_measured ? excitation_ : displacement_;
  }
  bool begin();
  bool extract(const ChannelBuffer& from, Nanoseconds begin, Nanoseconds end, Nanoseconds origin);
  double turns_at_middle(const HarmonicFit& fit, Nanoseconds begin, Nanoseconds end) const;
  bool revise_first();
  HarmonicFit fit_reference(Nanoseconds begin, Nanoseconds end);
  void assemble(Nanoseconds begin, Nanoseconds end, const HarmonicFit& reference_fit);
  void count_gaps(double period);
  bool resample_best(double period);
  void describe_excitation(const HarmonicFit& fit, double turns_at_begin);
  void describe_stroke();
  double turn_start(double turn) const { return turn - offset_turns_; }

  CycleOptions options_;
  ChannelBuffer displacement_, excitation_;
  PhaseTracker tracker_;
  HarmonicFitter fitter_{0};
  std::vector<double> t_, value_, smooth_, scratch_, other_;
  std::size_t extracted_ = 0;
  Nanoseconds from_{}, next_block_{}, first_block_{};
  bool first_only_ = false;  // what the tracker knows: one phase, fitted at the nominal frequency
  double next_turn_ = 0.0;
  double offset_turns_ = 0.0;  // of tau's zero against the reference channel's phase
  AssembledCycle cycle_;
};

}  // namespace shaker::daemon
