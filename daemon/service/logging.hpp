// The asynchronous log on stderr, which systemd passes to the journal. Callers never wait for
// it: if its queue is full, the oldest lines are dropped and counted.
#pragma once

#include <cstdint>

namespace shaker::daemon {

// Makes it the default logger for the life of this object.
class Logging {
 public:
  Logging();
  ~Logging();
  Logging(const Logging&) = delete;
  Logging& operator=(const Logging&) = delete;
};

std::uint64_t dropped_log_lines();

}  // namespace shaker::daemon
