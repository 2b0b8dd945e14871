// A log of Modbus polls as a source. Registers are processed as in the Modbus sensor.
#pragma once

#include <filesystem>
#include <memory>

#include "base/result.hpp"
#include "config/rig.hpp"
#include "drivers/replay/source.hpp"

namespace shaker::drivers::replay {

// An Error names the register. Lines that do not parse, or lack a register, are counted as
// malformed and skipped.
Result<std::unique_ptr<Source>> open_register_log(const config::ReplaySensor& config,
                                                  const std::filesystem::path& directory);

}  // namespace shaker::drivers::replay
