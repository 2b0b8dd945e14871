// Cyclic sending by the kernel that stops by itself: the dead-man of a CAN exciter.
//
// The broadcast manager (CAN_BCM) sends one frame now and then once a period, `count` times
// altogether. It goes on while the process hangs or after it was killed, but not for longer than
// that. There is no call here for unlimited sending, which would outlive everything. One thread.
// Source: Linux Documentation/networking/can.rst, broadcast manager.
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

  // Replaces what was sent before. Preconditions: a classic data frame, period > 0, count >= 1.
  Result<void> arm(const protocol::can::Frame& frame, Nanoseconds period, unsigned count);
  // What the kernel holds for this frame's identifier, read back. An Error when it differs.
  Result<void> verify(const protocol::can::Frame& frame);
  // True when the kernel has stopped sending since the last call, because it was not armed again in
  // time. An Error when the link is down or gone.
  Result<bool> expired();

 private:
  UniqueFd fd_;
  std::string interface_;
  bool expired_ = false;
};

}  // namespace shaker::drivers::can
