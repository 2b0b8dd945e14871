// Cyclic sending by the kernel that ends by itself: the dead-man of a CAN exciter.
//
// The broadcast manager (CAN_BCM) sends one frame at once and then once each period, `count`
// times in total. It continues if the process hangs or is killed, but not longer than that.
// This class offers no unlimited sending, which would outlive the daemon. One thread. Source:
// Linux Documentation/networking/can.rst, broadcast manager.
#pragma once

#include <string>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "base/unique_fd.hpp"
#include "protocol/can/frame.hpp"

namespace shaker::drivers::can {

class DeadMan {
 public:
  static Result<DeadMan> open(const std::string& interface);

  // Replaces the frame that was sent before. Preconditions: a classic data frame, period > 0,
  // count >= 1.
  Result<void> arm(const protocol::can::Frame& frame, Nanoseconds period, unsigned count);
  // Reads back what the kernel holds for this frame's identifier; an Error if it differs.
  Result<void> verify(const protocol::can::Frame& frame);
  // True if the kernel has stopped sending since the last call because it was not armed again
  // in time. An Error means that the link is down or gone.
  Result<bool> expired();

 private:
  UniqueFd fd_;
  std::string interface_;
  bool expired_ = false;
};

}  // namespace shaker::drivers::can
