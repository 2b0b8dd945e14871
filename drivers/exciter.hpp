// Port: the device that shakes the table.
//
// One owner, one thread (the daemon gives each exciter a thread of its own; in simulated time the
// engine calls it inline). Calls may block up to the device's response timeout, never longer. An
// Error's sentence is shown to the operator.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/clock.hpp"
#include "base/result.hpp"

namespace shaker::drivers {

// What the table is asked to do. amplitude is of the table's acceleration, m/s^2.
struct Setpoint {
  double frequency_hz = 0.0;
  double amplitude = 0.0;
  bool enable = false;
  double ramp_s = 0.0;
  bool operator==(const Setpoint&) const = default;
};

struct ExciterStatus {
  Nanoseconds t{};  // when it was read
  bool ready = false;
  bool running = false;
  std::uint32_t fault = 0;                        // 0: none
  std::optional<double> frequency_hz, amplitude;  // what the device says it does
  std::optional<double> heartbeat_timeout_s;      // its own reaction to a lost link; 0: none
};

class Exciter {
 public:
  virtual ~Exciter() = default;
  virtual std::string description() const = 0;  // for messages: "Modbus TCP 127.0.0.1:1502 unit 1"

  // Connects, or reconnects. Leaves the exciter as it is.
  virtual Result<void> connect() = 0;
  // Writes what changed, reads it back; an Error when the device holds something else.
  virtual Result<void> write(const Setpoint& setpoint) = 0;
  virtual Result<ExciterStatus> read() = 0;
  // Clears the device's latched fault where it has an order for that; false when it has none. Moves
  // nothing.
  virtual Result<bool> clear_fault() { return false; }
  // Keeps the device's dead-man alive. Called every heartbeat_period_s while motion is commanded.
  virtual Result<void> heartbeat() = 0;
  // Amplitude zero and disabled at once, without a ramp. Tries a reconnect if it must.
  virtual Result<void> stop() = 0;
};

}  // namespace shaker::drivers
