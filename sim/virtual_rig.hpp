// The rig that is not there: exciter controller, table, damper and sensors, stepped in time.
//
// Own physics, own integrator (Boost.Odeint), nothing of the estimator: a simulator that shares the
// estimator's code proves nothing. The same object serves two fronts: drivers/sim steps it on the
// simulated clock in process, and the executable `oleosim` steps it in real time behind Modbus and
// CAN. One thread.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "protocol/channel.hpp"

namespace shaker::sim {

// Instrument faults on demand.
enum class Fault {
  none,
  sensor_frozen,  // repeats its last value
  sensor_nan,
  sensor_silent,
  sensor_inverted,  // wrong polarity
  exciter_trip,     // fault code in `fault`, stops
  exciter_deaf,     // accepts writes, does not move
  exciter_silent    // does not answer
};

struct RigOptions {
  std::string plant = "oleo";                // sim/README.md lists the plants
  std::map<std::string, double> parameters;  // the truth, by name; missing ones take the default
  double sample_rate_hz = 1000.0;
  double noise_m = 2e-5, noise_m_s2 = 5e-3;  // standard deviations
  double quantum_m = 1e-6, quantum_m_s2 = 1e-4;
  double clock_offset_ppm = 0.0;  // of the rig's clock against ours
  double jitter_fraction = 0.0;   // of one sample, uniform
  double dropout_fraction = 0.0;
  double heartbeat_timeout_s = 0.5;  // the controller's own dead-man; 0: none
  std::uint64_t seed = 1;
};

struct RigSample {
  Nanoseconds t{};  // when it was taken, on our clock, with the rig's clock error and jitter
  double displacement = 0.0;  // m, noisy and quantised
  double excitation = 0.0;    // m/s^2
  bool dropped = false;
};

struct RigStatus {
  bool ready = false, running = false;
  std::uint32_t fault = 0;
  double frequency_hz = 0.0, amplitude = 0.0;  // now, on the ramp
};

class VirtualRig {
 public:
  // Throws std::invalid_argument naming an unknown plant or parameter.
  VirtualRig(const RigOptions& options, Nanoseconds start);
  ~VirtualRig();

  // The controller's face: what the register map writes and reads.
  void set_frequency(double hz);
  void set_amplitude(double m_s2);
  void set_enable(bool on);
  void set_ramp(double seconds);
  void heartbeat(std::uint32_t counter);
  RigStatus status() const;
  void clear_fault();

  void inject(Fault fault);

  // Integrates to `now` and appends the samples taken on the way.
  void advance(Nanoseconds now, std::vector<RigSample>& samples);

  // The noise-free truth, for tests and for the demo.
  double true_stroke() const;
  double true_velocity() const;
  const std::map<std::string, double>& true_parameters() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace shaker::sim
