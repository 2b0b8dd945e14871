// The CAN exciter's two frames: setpoint out, status in. Pure; const after make().
#pragma once

#include <cstdint>
#include <optional>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "config/rig.hpp"
#include "drivers/can/frame_decoder.hpp"
#include "drivers/exciter.hpp"
#include "protocol/can/database.hpp"
#include "protocol/can/frame.hpp"

namespace shaker::drivers::can {

class ExciterCodec {
 public:
  // The setpoint message needs signals named frequency (Hz), amplitude (m/s^2) and enable; ramp (s)
  // and heartbeat (a counter) are used where they exist. The status message needs status and fault;
  // frequency, amplitude and heartbeat_timeout (s) are used where they exist. Units that the
  // database states must be these.
  static Result<ExciterCodec> make(const protocol::can::Database& database,
                                   const config::CanExciter& config);

  // An Error names a value that its signal cannot hold. The counter wraps at the signal's width.
  Result<protocol::can::Frame> setpoint(const Setpoint& setpoint, std::uint64_t heartbeat) const;

  // An Error when the frame has not the message's length. Ready: all bits of the mask and no fault.
  // A value that its signal cannot have is left out.
  Result<ExciterStatus> status(const protocol::can::Frame& frame, Nanoseconds t) const;
  bool is_status(const protocol::can::Frame& frame) const;
  bool is_setpoint(const protocol::can::Frame& frame) const;
  // Precondition: is_setpoint(frame). True also when the frame has not the message's length: nobody
  // knows what the drive makes of it.
  bool commands_motion(const protocol::can::Frame& frame) const;

  Identifier status_identifier() const { return {status_.id, status_.extended}; }
  Identifier setpoint_identifier() const { return {setpoint_.id, setpoint_.extended}; }
  std::optional<double> status_period_s() const { return status_.cycle_time_s; }
  // How long a status may be missing: five of its periods, 0.1 s at least; 0.5 s when none is
  // stated.
  Nanoseconds status_limit() const;

 private:
  protocol::can::Message setpoint_, status_;
  std::uint32_t running_mask_ = 0, ready_mask_ = 0;
};

}  // namespace shaker::drivers::can
