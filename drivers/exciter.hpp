// Port: the device that shakes the table.
//
// One owner, one thread: the daemon gives each exciter a thread of its own; in simulated time
// the engine calls it inline. A request to the device blocks for its response timeout at most.
// A call may consist of several requests, and stop() may also reconnect. The text of an Error
// is for the operator.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/clock.hpp"
#include "base/result.hpp"

namespace shaker::drivers {

// The commanded motion. amplitude is the amplitude of the table's acceleration, m/s^2; ramp_s
// in s.
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
  std::optional<double> frequency_hz, amplitude;  // as reported by the device
  std::optional<double> heartbeat_timeout_s;      // the device's dead-man timeout; 0: none
};

class Exciter {
 public:
  virtual ~Exciter() = default;
  virtual std::string description() const = 0;  // for messages: "Modbus TCP 127.0.0.1:1502 unit 1"

  // Connects or reconnects. Does not change the state of the exciter.
  virtual Result<void> connect() = 0;
  // Writes the changed values and reads them back. Returns an Error if the device holds other
  // values.
  virtual Result<void> write(const Setpoint& setpoint) = 0;
  virtual Result<ExciterStatus> read() = 0;
  // Clears the device's latched fault, as far as it can: stop() disables, which ends a trip of many
  // a dead-man; a device that has an order for it gets that too. Moves nothing.
  virtual Result<void> clear_fault() { return stop(); }
  // Sends one heartbeat to the device's dead-man. Called every heartbeat_period_s during
  // motion.
  virtual Result<void> heartbeat() = 0;
  // Sets amplitude zero and disables at once, without a ramp. Reconnects if necessary.
  virtual Result<void> stop() = 0;
};

}  // namespace shaker::drivers
