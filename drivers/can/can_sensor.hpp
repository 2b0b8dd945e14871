// The displacement (and excitation) sensor on a CAN bus.
//
// Samples are stamped with the kernel's receive time, brought to the daemon's monotonic clock
// (stamps.hpp). Adapters' own stamps are noted in description(), not used: their clock has an
// origin and a drift of its own. When the link goes down or away, read() returns an Error and
// connect() opens it again by name.
#pragma once

#include <filesystem>
#include <memory>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "config/rig.hpp"
#include "drivers/sensor.hpp"

namespace shaker::drivers::can {

// Reads the DBC file (relative to `directory`), opens nothing else. `clock` must be a real one and
// outlive the sensor. An Error is about the configuration: file, message, signal.
Result<std::unique_ptr<Sensor>> make_can_sensor(const config::CanSensor& config,
                                                const std::filesystem::path& directory,
                                                const Clock& clock);

}  // namespace shaker::drivers::can
