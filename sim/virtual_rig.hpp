// The virtual rig: exciter controller, table, damper and sensors, stepped in time.
//
// It has its own physics and its own integrator (Boost.Odeint). It shares no code with the
// estimator, because a simulator that did so would prove nothing. The same class has two uses:
// drivers/sim steps it in process on the simulated clock, and the program `oleosim` steps it in
// real time behind Modbus and CAN. Not thread-safe: one thread at a time may use an object.
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

// Faults that a user can inject.
enum class Fault {
  none,
  sensor_frozen,    // the displacement repeats its last value
  sensor_nan,       // the displacement is not a number
  sensor_silent,    // no samples of either channel
  sensor_inverted,  // wrong polarity of the displacement
  exciter_trip,     // sets a fault code and stops the table, once
  exciter_deaf,     // accepts writes and reports running, but does not move
  exciter_silent    // neither hears nor answers: the server must not reply
};
inline constexpr int kFaultCount = 8;
std::string_view name(Fault fault);  // "sensor_frozen"
std::optional<Fault> fault_from_name(std::string_view text);

// The fault codes that the controller reports.
enum class FaultCode : std::uint32_t {
  none = 0,
  heartbeat_lost = 1,  // its own dead-man has stopped the table
  tripped = 2,         // Fault::exciter_trip
  bottomed = 3         // the damper's gas column is used up: metal met metal
};

// The highest values that the controller accepts: Hz, m/s^2, s.
inline constexpr double kHighestFrequency = 50.0, kHighestAmplitude = 50.0, kLongestRamp = 600.0;
inline constexpr double kLongestHeartbeatTimeout = 60.0;

struct RigOptions {
  std::string plant = "oleo";  // sim/README.md lists the plants
  // True parameters of plant and instruments by name; missing ones take the default.
  std::map<std::string, double> parameters;
  double sample_rate_hz = 1000.0;
  double noise_m = 2e-5, noise_m_s2 = 5e-3;  // standard deviations of the two channels
  double quantum_m = 1e-6, quantum_m_s2 = 1e-4;
  double clock_offset_ppm = 0.0;  // of the rig's clock against the host's
  // The largest delay of a sample's stamp and delivery, as a fraction of the sample period; the
  // delay is uniformly distributed.
  double jitter_fraction = 0.0;
  double dropout_fraction = 0.0;
  double heartbeat_timeout_s = 0.5;  // the controller's own dead-man; 0 disables it
  std::uint64_t seed = 1;
  std::vector<std::string> auxiliary;  // names of the auxiliary quantities to measure
};

struct RigSample {
  Nanoseconds t{};              // host's clock, with the rig's clock error and the jitter
  double displacement = 0.0;    // m, noisy and quantised
  double excitation = 0.0;      // m/s^2
  AuxiliaryValues auxiliary{};  // in the order of RigOptions::auxiliary
  bool dropped = false;         // sampled, but lost on the way
  std::uint32_t counter = 0;    // of the samples taken
  std::uint32_t device_us = 0;  // the rig's own clock at the sampling instant, microseconds
};

struct RigStatus {
  bool ready = false, running = false;
  std::uint32_t fault = 0;
  double frequency_hz = 0.0, amplitude = 0.0;  // now, on the ramp, by the rig's own clock
};

// The settings that the controller has received.
struct RigSettings {
  double frequency_hz = 0.0, amplitude = 0.0, ramp_s = 0.0;
  double heartbeat_timeout_s = 0.0;
  std::uint32_t heartbeat = 0;
  bool enable = false;
};

class VirtualRig {
 public:
  // Throws std::invalid_argument that names an unknown plant, parameter or auxiliary quantity,
  // or a value out of range. `start`: time of the start, on the host's clock.
  VirtualRig(const RigOptions& options, Nanoseconds start);
  ~VirtualRig();

  // The controller's interface, which the register map writes and reads. A call acts at the
  // time to which the rig was last advanced. It returns false when the rig refuses it: the
  // value is out of range, the call enables a rig that has a fault, or exciter_silent is injected.
  //
  // Enabling starts from amplitude zero through the ramp. A new setpoint while the table runs
  // is reached through the ramp. Disabling stops the table at once. A fault disables and stops
  // the table at once. It stays until it is cleared: by clear_fault(), or by disabling and
  // enabling again; heartbeat_lost is cleared by disabling alone. Motion never restarts by
  // itself.
  bool set_frequency(double hz);
  bool set_amplitude(double m_s2);
  bool set_enable(bool on);
  bool set_ramp(double seconds);
  bool set_heartbeat_timeout(double seconds);  // 0 disables the dead-man
  void heartbeat(std::uint32_t counter);       // a new counter is a sign of life
  RigStatus status() const;
  RigSettings settings() const;
  void clear_fault();

  // Replaces the injected fault; Fault::none removes it. exciter_trip acts once and does not
  // replace it.
  void inject(Fault fault);
  Fault injected() const;

  // Integrates to `now` and appends the samples that arrive until then, including those marked
  // `dropped`. Earlier times do nothing.
  void advance(Nanoseconds now, std::vector<RigSample>& samples);
  // The delivery time of the next sample.
  Nanoseconds next_sample() const;

  // The true motion without noise (m, m/s, m/s^2), for tests and for the demo.
  double true_stroke() const;
  double true_velocity() const;
  double true_excitation() const;
  const std::map<std::string, double>& true_parameters() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace shaker::sim
