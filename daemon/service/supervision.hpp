// Who does not advance, and what follows: the motion ends along its ramp, or systemd's watchdog is
// no longer told that all is well.
//
// A sensor or exciter that does not answer is not a hang: its thread goes on trying, and the
// engine's own limits act on it. A thread that is stuck is one, and only a restart helps.
#pragma once

#include <optional>
#include <string>

#include "base/clock.hpp"

namespace shaker::daemon {

struct Progress {
  Nanoseconds acquisition{};  // when the slowest of the sensors' threads advanced
  Nanoseconds engine{}, exciter{};
  std::optional<Nanoseconds> estimator_busy;  // since when; nothing when idle
  Nanoseconds recorder{};
  bool recorder_idle = true;
};

// Which of them is stuck, a sentence; empty when none is. The clients' loop is not among them: it
// asks.
std::string stuck(const Progress& progress, Nanoseconds now);

// Threads without which nothing is in danger at once, but without which no motion may go on.
struct Helpers {
  Nanoseconds clients{};                      // when clients were last heard
  std::optional<Nanoseconds> estimator_busy;  // since when; nothing when idle
};
struct EndOfMotion {
  std::string code, why;  // of the alarm
};
std::optional<EndOfMotion> must_end(const Helpers& helpers, Nanoseconds now);

}  // namespace shaker::daemon
