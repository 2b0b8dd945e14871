// Encodes the setpoint frame and decodes the status frame of the CAN exciter. Pure; const after
// make().
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
  // The setpoint message requires the signals frequency (Hz), amplitude (m/s^2) and enable;
  // ramp (s) and heartbeat (a counter) are optional. The status message requires status and
  // fault; frequency, amplitude and heartbeat_timeout (s) are optional. A known unit of the
  // database is converted to the one given here; an unknown unit is an Error.
  static Result<ExciterCodec> make(const protocol::can::Database& database,
                                   const config::CanExciter& config);

  // An Error names a value that its signal cannot hold. The counter wraps at the width of its
  // signal.
  Result<protocol::can::Frame> setpoint(const Setpoint& setpoint, std::uint64_t heartbeat) const;

  // Returns an Error if the frame does not have the message's length. Ready means all bits of
  // the mask and no fault. A value outside its signal's range is omitted.
  Result<ExciterStatus> status(const protocol::can::Frame& frame, Nanoseconds t) const;
  bool is_status(const protocol::can::Frame& frame) const;
  bool is_setpoint(const protocol::can::Frame& frame) const;
  // Precondition: is_setpoint(frame). Also true if the frame does not have the message's
  // length, because the drive's reaction to it is unknown.
  bool commands_motion(const protocol::can::Frame& frame) const;

  Identifier status_identifier() const { return {status_.id, status_.extended}; }
  Identifier setpoint_identifier() const { return {setpoint_.id, setpoint_.extended}; }
  std::optional<double> status_period_s() const { return status_.cycle_time_s; }
  // Largest age of a status: five of its periods, at least 0.1 s; 0.5 s if the database states
  // none.
  Nanoseconds status_limit() const;

 private:
  protocol::can::Message setpoint_, status_;
  std::uint32_t running_mask_ = 0, ready_mask_ = 0;
};

}  // namespace shaker::drivers::can
