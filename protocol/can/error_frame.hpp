// Error frames: what the adapter's driver reports about the bus, in sentences for an operator.
//
// SocketCAN delivers them as frames with CAN_ERR_FLAG (linux/can/error.h), also in candump logs.
// Pure.
#pragma once

#include <string>

#include "protocol/can/frame.hpp"

namespace shaker::protocol::can {

struct ErrorReport {
  bool bus_off = false;    // the controller has left the bus
  bool restarted = false;  // it is back
  bool passive = false;    // error-passive: bus-off is near
  std::uint32_t lost = 0;  // at least so many frames that the controller itself dropped
};

// Precondition: frame.error.
ErrorReport interpret_error(const Frame& frame);

// Appends one sentence that names `interface`, the trouble and the remedy. Allocates only when
// `text` has no room.
void describe_error(const Frame& frame, const std::string& interface, std::string& text);

}  // namespace shaker::protocol::can
