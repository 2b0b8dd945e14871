// Cuts samples into whole periods of the excitation.
//
// tau = 0 is the positive peak of the excitation's fundamental. With a measured excitation, its
// phase is followed period by period (PhaseTracker). The excitation of a cycle then consists of
// its fundamental and harmonics 2 to 5, at the phase of this cycle (the tracker's line follows
// a wandering phase some cycles late). It has no mean: a table does not accelerate on average,
// so a mean is the accelerometer's offset. The content above the fifth harmonic is mostly
// noise. Without a measured excitation, the frequency comes from the fundamental of the stroke
// and tau = 0 from the commanded phase, which does not contain the drive's delay. The damping
// is then biased, and every estimate carries a warning.
//
// Time stamps may be disturbed (a kernel's receive time), or correct for a sampling that is
// irregular itself. Each cycle is resampled with the given stamps and with stamps on a regular
// clock. The given ones are kept unless the regular ones give a clearly smaller residual.
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
#include "estimator/online/measured_cycle.hpp"
#include "protocol/channel.hpp"

namespace shaker::daemon {

struct CycleOptions {
  int points = 64;
  double nominal_hz = 1.0;
  double sample_rate_hz = 1000.0;      // of the displacement
  double excitation_rate_hz = 1000.0;  // both rates determine the memory
  bool excitation_measured = true;
};

struct AssembledCycle {
  estimator::MeasuredCycle measured;  // the caller fills run and index
  bool whole = false;
  std::string why;            // the reason, if not whole
  Nanoseconds begin{};        // of the period
  Nanoseconds last_sample{};  // time stamp of the newest sample used
  long samples = 0;           // of the displacement
  int gaps = 0;               // number of places with missing samples
  double longest_gap_s = 0.0;
  double jitter_fraction = 0.0;  // of the stamps about a regular clock, in intervals
  double sample_noise = 0.0, point_noise = 0.0;  // m
  double stroke_min = 0.0, stroke_max = 0.0;     // of the resampled points, m
  double excitation_noise = 0.0;                 // m/s^2, of one sample
  double lag_turns = 0.0;         // of the stroke's fundamental behind the excitation's, 0..1
  double stroke_amplitude = 0.0;  // of its fundamental, m
};

class CycleAssembler {
 public:
  // Allocates. Cycles begin after `from`.
  void restart(const CycleOptions& options, Nanoseconds from);
  void push(protocol::Channel channel, Nanoseconds t, double value);
  // Returns the next period once its samples are there, or null. Valid until the next call.
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
  bool first_only_ = false;  // the tracker has one phase, fitted at the nominal frequency
  double next_turn_ = 0.0;
  double offset_turns_ = 0.0;  // of tau = 0 from the phase of the reference channel
  AssembledCycle cycle_;
};

}  // namespace shaker::daemon
