// An exciter that receives its setpoint in a cyclic CAN frame and reports its status in
// another.
//
// The kernel sends the setpoint and stops by itself three heartbeat periods after it was last
// armed (dead_man.hpp). A hung or killed daemon therefore leaves a silent bus, and the drive's
// own watchdog stops the drive. After that, heartbeat() refuses until a setpoint at rest
// (amplitude zero or disabled) has been written: motion never resumes by itself. The read-back
// covers what the kernel holds, because a drive on its ramp correctly reports other values than
// the setpoint. The driver also examines the bus: read() reports another node that sends the
// setpoint, and frames of ours that do not reach the bus; stop() succeeds once its frame was on
// the bus (bus_watch.hpp).
#pragma once

#include <filesystem>
#include <memory>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "config/rig.hpp"
#include "drivers/exciter.hpp"

namespace shaker::drivers::can {

// Reads the DBC file (relative to `directory`) and opens nothing else. `clock` must be a real
// clock and outlive the exciter.
Result<std::unique_ptr<Exciter>> make_can_exciter(const config::CanExciter& config,
                                                  double heartbeat_period_s,
                                                  const std::filesystem::path& directory,
                                                  const Clock& clock);

}  // namespace shaker::drivers::can
