// Supervision of the threads. If one does not advance, the motion ends along its ramp, or
// systemd's watchdog is no longer notified.
//
// A sensor or exciter that does not answer is not a hang: its thread keeps trying, and the
// engine's own limits act. A thread that is stuck is a hang, and only a restart helps.
#pragma once

#include <optional>
#include <string>

#include "base/clock.hpp"

namespace shaker::daemon {

struct Progress {
  Nanoseconds acquisition{};  // last progress of the slowest sensor thread
  Nanoseconds engine{}, exciter{};
  std::optional<Nanoseconds> estimator_busy;  // start of its work; empty if idle
  Nanoseconds recorder{};
  bool recorder_idle = true;
};

// A sentence that names the stuck thread; empty if there is none. The clients' loop is not
// checked, because it makes this call.
std::string stuck(const Progress& progress, Nanoseconds now);

// Threads whose hang is not dangerous at once, but whose hang must end the motion.
struct Helpers {
  Nanoseconds clients{};                      // last progress of the clients' thread
  std::optional<Nanoseconds> estimator_busy;  // start of its work; empty if idle
};
struct EndOfMotion {
  std::string code, why;  // of the alarm
};
std::optional<EndOfMotion> must_end(const Helpers& helpers, Nanoseconds now);

}  // namespace shaker::daemon
