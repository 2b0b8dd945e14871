// Supervises the two messages of a CAN exciter by what the bus carries.
//
// Every frame that leaves this PC returns to its listeners once it is on the bus, as do the
// frames of other nodes. The drive may follow a setpoint that is not ours. A setpoint of ours
// that never returns was not sent, even if the kernel took it. A status that comes more often
// than the database states has two senders. Pure; one thread; does not allocate.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "base/clock.hpp"
#include "protocol/can/frame.hpp"

namespace shaker::drivers::can {

class BusWatch {
 public:
  BusWatch(Nanoseconds setpoint_period, std::optional<double> status_period_s);

  // The kernel now sends `frame`; or (silent) no frame any more.
  void sending(const protocol::can::Frame& frame, Nanoseconds now);
  void silent(Nanoseconds now);

  // Takes a frame with the setpoint's identifier. Returns false if it is not a frame that was
  // being sent within the last second: an old one may have waited in a queue.
  bool is_ours(const protocol::can::Frame& frame, Nanoseconds t);
  void on_status(Nanoseconds t);

  // The current frame has returned.
  bool heard() const { return heard_; }
  // Call at each examination of the bus, after its frames. True if frames are being sent and
  // none has returned for five periods (at least 0.2 s), nor in the last three examinations.
  bool unheard(Nanoseconds now);
  // True if two half seconds in a row had more than 1.5 times the stated number of statuses.
  bool two_senders() const { return crowded_ >= kCrowdedInARow; }

 private:
  static constexpr std::size_t kRemembered = 64;
  static constexpr int kCrowdedInARow = 2;
  static constexpr int kLooks = 3;
  struct Sent {
    protocol::can::Frame frame;
    Nanoseconds replaced{};
  };

  Nanoseconds patience_;
  std::array<Sent, kRemembered> sent_{};
  std::size_t count_ = 0;  // of all; the newest is sent_[(count_ - 1) % kRemembered]
  bool active_ = false, heard_ = false;
  Nanoseconds last_heard_{};
  int looks_ = 0;  // examinations without one of our frames

  std::optional<double> allowed_;  // limit of statuses in half a second
  Nanoseconds window_began_{};
  int in_window_ = 0, crowded_ = 0;
};

}  // namespace shaker::drivers::can
