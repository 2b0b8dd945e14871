// What the bus itself shows of a CAN exciter's two messages.
//
// Every frame that leaves this PC comes back to its listeners once it is on the bus, and so does
// what other nodes send. A setpoint that is not ours may be what the drive follows; a setpoint of
// ours that never comes back was not sent, whatever the kernel took; a status that comes more often
// than the database says has two senders. Pure; one thread; does not allocate.
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

  // The kernel now sends `frame`, or nothing any more.
  void sending(const protocol::can::Frame& frame, Nanoseconds now);
  void silent(Nanoseconds now);

  // A frame with the setpoint's identifier. False when it is none that was being sent, up to one
  // second before: an old one may have waited in a queue.
  bool is_ours(const protocol::can::Frame& frame, Nanoseconds t);
  void on_status(Nanoseconds t);

  // The present frame has come back.
  bool heard() const { return heard_; }
  // To be called at each look at the bus, after what it brought: true when frames are being sent
  // and none has come back for five periods (0.2 s at least), nor since the two looks before.
  bool unheard(Nanoseconds now);
  // Two half seconds in a row brought more than one and a half times the stated number.
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
  int looks_ = 0;  // without one of ours

  std::optional<double> allowed_;  // statuses in half a second
  Nanoseconds window_began_{};
  int in_window_ = 0, crowded_ = 0;
};

}  // namespace shaker::drivers::can
