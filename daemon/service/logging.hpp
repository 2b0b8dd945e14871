// The log, on stderr (which systemd gives to the journal). Nobody waits for it: when it cannot keep
// up, the oldest lines go, and they are counted.
#pragma once

#include <cstdint>

namespace shaker::daemon {

// Makes it the default logger, until destroyed.
class Logging {
 public:
  Logging();
  ~Logging();
  Logging(const Logging&) = delete;
  Logging& operator=(const Logging&) = delete;
};

std::uint64_t dropped_log_lines();

}  // namespace shaker::daemon
