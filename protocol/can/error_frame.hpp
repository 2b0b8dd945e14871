// Describes error frames, by which the adapter's driver reports the state of the bus, for an
// operator.
//
// SocketCAN delivers them as frames with CAN_ERR_FLAG (linux/can/error.h); candump logs have
// them too. Pure.
#pragma once

#include <string>

#include "protocol/can/frame.hpp"

namespace shaker::protocol::can {

struct ErrorReport {
  bool bus_off = false;    // the controller has left the bus
  bool restarted = false;  // the controller is back on the bus
  bool passive = false;    // error-passive: bus-off is near
  std::uint32_t lost = 0;  // lower limit of the frames that the controller dropped
};

// Precondition: frame.error.
ErrorReport interpret_error(const Frame& frame);

// Appends one sentence with `interface`, the problem and the remedy. Allocates only if `text`
// has no room.
void describe_error(const Frame& frame, const std::string& interface, std::string& text);

}  // namespace shaker::protocol::can
