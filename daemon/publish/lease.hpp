// Who is in control. One client at a time, for as long as it says so at least every `duration`.
//
// Any request of the holder renews the lease. Starting motion needs it; stopping never does. Plain
// bookkeeping: no clock and no socket of its own.
#pragma once

#include <optional>

#include "base/clock.hpp"

namespace shaker::daemon {

class Lease {
 public:
  explicit Lease(Nanoseconds duration) : duration_(duration) {}

  // False when another client holds it.
  bool acquire(int client, Nanoseconds now);
  void renew(int client, Nanoseconds now);  // nothing when it is not the holder
  // True when that client held it: it is free now.
  bool release(int client);
  // The holder whose time is over; it is free now.
  std::optional<int> expire(Nanoseconds now);

  bool held_by(int client) const { return holder_ == client; }
  std::optional<int> holder() const { return holder_; }
  Nanoseconds duration() const { return duration_; }

 private:
  Nanoseconds duration_;
  std::optional<int> holder_;
  Nanoseconds until_{};
};

}  // namespace shaker::daemon
