// What the sensors make of the truth: sampling on the rig's own clock, gain, offset, drift, delay,
// lag, noise, quantisation, late delivery, loss, and the faults of a sensor.
//
// All channels are sampled together. The rig's clock runs (1 + ppm 1e-6) times as fast as ours, so
// the instants of sampling are on it; a sample is delivered, and stamped on our clock, when it
// arrives: up to jitter_fraction of a sample late.
#pragma once

#include <optional>
#include <random>
#include <span>
#include <vector>

#include "sim/plant_part.hpp"
#include "sim/virtual_rig.hpp"

namespace shaker::sim {

// Parameters of the instruments, which share RigOptions::parameters with the plant's.
std::span<const Parameter> instrument_parameters();

// A signal some samples ago, between two of them on the straight line.
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
  // `values` holds every instrument parameter.
  Instruments(const RigOptions& options, const Values& values, Nanoseconds start);

  // Instant of the next sampling, on our clock.
  Nanoseconds due() const { return due_; }
  // When what comes next is delivered: a sample on its way, or else one taken at due() at once.
  Nanoseconds next_delivery() const { return on_its_way_ ? on_its_way_->t : due_; }

  // Samples the truth at due() and computes the next one.
  void take(double stroke, double excitation, const AuxiliaryValues& auxiliary, Fault fault);
  // Appends the sample on its way if it has arrived.
  void deliver(Nanoseconds now, std::vector<RigSample>& out);

 private:
  double through_transducer(double stroke);
  double read_out(double truth, double noise, double quantum);
  Nanoseconds instant(std::int64_t k) const;

  RigOptions options_;
  double gain_, offset_, quadratic_, drift_, excitation_gain_;
  // Of the low pass: shares of the last output, of the input's slope and of its bend in the next
  // output.
  double lag_kept_ = 0.0, lag_slope_ = 1.0, lag_bend_ = 0.0;
  double period_s_, rate_;
  Nanoseconds start_, due_;
  std::int64_t k_ = 0;
  DeadTime stroke_delay_, excitation_delay_;
  std::optional<double> lagged_, frozen_;
  double before_lag_ = 0.0, long_before_lag_ = 0.0;
  std::optional<RigSample> on_its_way_;
  // Apart, so that turning one imperfection on leaves the others as they were.
  std::mt19937_64 noise_source_, arrival_source_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
};

}  // namespace shaker::sim
