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
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock.hpp"
#include "sim/auxiliary.hpp"

namespace shaker::sim {

// Instrument faults on demand.
enum class Fault {
  none,
  sensor_frozen,    // the displacement repeats its last value
  sensor_nan,       // the displacement is not a number
  sensor_silent,    // no samples of either channel
  sensor_inverted,  // wrong polarity of the displacement
  exciter_trip,     // fault code in `fault`, stops
  exciter_deaf,     // accepts writes, says that it runs, does not move
  exciter_silent    // does not answer, nor hear: whoever serves it must not reply
};
inline constexpr int kFaultCount = 8;
std::string_view name(Fault fault);  // "sensor_frozen"
std::optional<Fault> fault_from_name(std::string_view text);

// What the controller says in `fault`.
enum class FaultCode : std::uint32_t {
  none = 0,
  heartbeat_lost = 1,  // its own dead-man stopped the table
  tripped = 2,         // Fault::exciter_trip
  bottomed = 3         // the damper's gas column is used up: metal met metal
};

// What the controller accepts.
inline constexpr double kHighestFrequency = 50.0, kHighestAmplitude = 50.0, kLongestRamp = 600.0;
inline constexpr double kLongestHeartbeatTimeout = 60.0;

struct RigOptions {
  std::string plant = "oleo";  // sim/README.md lists the plants
  // The truth by name, of the plant and of the instruments; missing ones take the default.
  std::map<std::string, double> parameters;
  double sample_rate_hz = 1000.0;
  double noise_m = 2e-5, noise_m_s2 = 5e-3;  // standard deviations
  double quantum_m = 1e-6, quantum_m_s2 = 1e-4;
  double clock_offset_ppm = 0.0;  // of the rig's clock against ours
  // A sample is stamped, and delivered, up to so much of a sample late, uniformly.
  double jitter_fraction = 0.0;
  double dropout_fraction = 0.0;
  double heartbeat_timeout_s = 0.5;  // the controller's own dead-man; 0: none
  std::uint64_t seed = 1;
  std::vector<std::string> auxiliary;  // quantities measured besides (sim/auxiliary.hpp)
};

struct RigSample {
  Nanoseconds t{};  // when it was taken, on our clock, with the rig's clock error and jitter
  double displacement = 0.0;    // m, noisy and quantised
  double excitation = 0.0;      // m/s^2
  AuxiliaryValues auxiliary{};  // in the order of RigOptions::auxiliary
  bool dropped = false;         // taken, and lost on the way
  std::uint32_t counter = 0;    // of samples taken
  std::uint32_t device_us = 0;  // the rig's own clock when it was taken, microseconds
};

struct RigStatus {
  bool ready = false, running = false;
  std::uint32_t fault = 0;
  double frequency_hz = 0.0, amplitude = 0.0;  // now, on the ramp, by the rig's own clock
};

// What the controller was told.
struct RigSettings {
  double frequency_hz = 0.0, amplitude = 0.0, ramp_s = 0.0;
  double heartbeat_timeout_s = 0.0;
  std::uint32_t heartbeat = 0;
  bool enable = false;
};

class VirtualRig {
 public:
  // Throws std::invalid_argument naming an unknown plant or parameter, or a value out of range.
  VirtualRig(const RigOptions& options, Nanoseconds start);
  ~VirtualRig();

  // The controller's face: what the register map writes and reads. It acts at the time to which the
  // rig was last advanced. False when it refuses: a value out of range, or enabling with a fault.
  // Enabling starts from amplitude zero through the ramp; a new setpoint while it runs is reached
  // through the ramp; disabling stops the table at once. A fault disables and stops at once, and
  // stays until it is cleared: by clear_fault(), or by disabling (enough for heartbeat_lost) and
  // enabling again. Motion never comes back by itself.
  bool set_frequency(double hz);
  bool set_amplitude(double m_s2);
  bool set_enable(bool on);
  bool set_ramp(double seconds);
  bool set_heartbeat_timeout(double seconds);  // 0: no dead-man
  void heartbeat(std::uint32_t counter);       // alive when the counter differs from the last one
  RigStatus status() const;
  RigSettings settings() const;
  void clear_fault();

  // Replaces the fault injected before; none takes it away. exciter_trip happens once.
  void inject(Fault fault);
  Fault injected() const;

  // Integrates to `now` and appends the samples taken on the way. Earlier times do nothing.
  void advance(Nanoseconds now, std::vector<RigSample>& samples);
  // When the next sample is due (delivered).
  Nanoseconds next_sample() const;

  // The noise-free truth, for tests and for the demo.
  double true_stroke() const;
  double true_velocity() const;
  double true_excitation() const;
  const std::map<std::string, double>& true_parameters() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace shaker::sim
