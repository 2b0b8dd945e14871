// The displacement (and excitation) sensor on a CAN bus.
//
// Samples carry the kernel's receive time, converted to the daemon's monotonic clock
// (stamps.hpp). Stamps of the adapter are mentioned in description() but not used, because
// their clock has its own origin and drift. If the link goes down or away, read() returns an
// Error and connect() opens it again by name.
#pragma once

#include <filesystem>
#include <memory>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "config/rig.hpp"
#include "drivers/sensor.hpp"

namespace shaker::drivers::can {

// Reads the DBC file (relative to `directory`) and opens nothing else. `clock` must be a real
// clock and outlive the sensor. An Error concerns the configuration: file, message or signal.
Result<std::unique_ptr<Sensor>> make_can_sensor(const config::CanSensor& config,
                                                const std::filesystem::path& directory,
                                                const Clock& clock);

}  // namespace shaker::drivers::can
