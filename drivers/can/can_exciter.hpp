// An exciter that takes its setpoint as a cyclic CAN frame and reports with another.
//
// The kernel sends the setpoint and stops by itself three heartbeat periods after it was last armed
// (dead_man.hpp), so that a hung or killed daemon leaves a silent bus and the drive's own watchdog
// stops it. Once that has happened, heartbeat() refuses until a setpoint at rest (amplitude zero or
// disabled) has been written: motion never resumes by itself. "Read back" is what the kernel holds,
// since a drive on its ramp rightly reports other values than the setpoint. The bus is listened to
// as well: read() says when another node sends the setpoint too, and when our frames do not get
// there; stop() is done when its frame was on the bus (bus_watch.hpp).
#pragma once

#include <filesystem>
#include <memory>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "config/rig.hpp"
#include "drivers/exciter.hpp"

namespace shaker::drivers::can {

// Reads the DBC file (relative to `directory`), opens nothing else. `clock` must be a real one and
// outlive the exciter.
Result<std::unique_ptr<Exciter>> make_can_exciter(const config::CanExciter& config,
                                                  double heartbeat_period_s,
                                                  const std::filesystem::path& directory,
                                                  const Clock& clock);

}  // namespace shaker::drivers::can
