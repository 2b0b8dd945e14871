// The control lease. One client at a time is in control, as long as it renews the lease within
// `duration`.
//
// Any request of the holder renews the lease. Starting motion requires it; stopping never does.
// This class has no clock and no socket.
#pragma once

#include <optional>

#include "base/clock.hpp"

namespace shaker::daemon {

class Lease {
 public:
  explicit Lease(Nanoseconds duration) : duration_(duration) {}

  // Returns false if another client holds the lease.
  bool acquire(int client, Nanoseconds now);
  void renew(int client, Nanoseconds now);  // no effect if not the holder
  // Frees the lease. Returns true if that client held it.
  bool release(int client);
  // If the time of the holder is over, frees the lease and returns that client.
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
