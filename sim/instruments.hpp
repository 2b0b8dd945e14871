// The sensors of the virtual rig: they turn the true motion into samples. They model sampling
// on the rig's own clock, gain, offset, drift, dead time, low pass, noise, quantisation, late
// delivery, loss and sensor faults.
//
// All channels are sampled together. The rig's clock runs (1 + ppm 1e-6) times as fast as the
// host's, and it sets the sampling instants. A sample is delivered when it arrives, up to
// jitter_fraction of a sample period late, and carries this arrival time on the host's clock.
#pragma once

#include <optional>
#include <random>
#include <span>
#include <vector>

#include "sim/plant_part.hpp"
#include "sim/virtual_rig.hpp"

namespace shaker::sim {

// Parameters of the instruments. They share RigOptions::parameters with those of the plant.
std::span<const Parameter> instrument_parameters();

// A dead time: returns the signal `samples` samples ago, by linear interpolation between
// samples. Before the first sample the signal has that sample's value.
class DeadTime {
 public:
  explicit DeadTime(double samples);
  double pass(double value);

 private:
  std::size_t whole_;
  double part_;
  std::vector<double> past_;  // a ring
  std::size_t newest_ = 0;
  bool first_ = true;
};

class Instruments {
 public:
  // `values` must hold every instrument parameter.
  Instruments(const RigOptions& options, const Values& values, Nanoseconds start);

  // The next sampling instant, on the host's clock.
  Nanoseconds due() const { return due_; }
  // The time of the next delivery, on the host's clock: of the sample on its way, or otherwise
  // of the next sample if it arrives without delay.
  Nanoseconds next_delivery() const { return on_its_way_ ? on_its_way_->t : due_; }

  // Samples the true motion (stroke m, excitation m/s^2) at due() and advances due() by one
  // sample.
  void take(double stroke, double excitation, const AuxiliaryValues& auxiliary, Fault fault);
  // Appends the sample on its way if it has arrived by `now`.
  void deliver(Nanoseconds now, std::vector<RigSample>& out);

 private:
  double through_transducer(double stroke);
  double read_out(double truth, double noise, double quantum);
  Nanoseconds instant(std::int64_t k) const;

  RigOptions options_;
  double gain_, offset_, quadratic_, drift_, excitation_gain_;
  // Coefficients of the low pass in the next output: of the last output, of the input's first
  // difference and of its second difference.
  double lag_kept_ = 0.0, lag_slope_ = 1.0, lag_bend_ = 0.0;
  double period_s_, rate_;
  Nanoseconds start_, due_;
  std::int64_t k_ = 0;
  DeadTime stroke_delay_, excitation_delay_;
  std::optional<double> lagged_, frozen_;
  double before_lag_ = 0.0, long_before_lag_ = 0.0;
  std::optional<RigSample> on_its_way_;
  // Two sources, so that one imperfection can be turned on without changing the random values
  // of the others.
  std::mt19937_64 noise_source_, arrival_source_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
};

}  // namespace shaker::sim
