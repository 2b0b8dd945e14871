// A `candump -l` log as a source. Frames, also error frames, are processed as in the CAN
// sensor.
#pragma once

#include <filesystem>
#include <memory>

#include "base/result.hpp"
#include "config/rig.hpp"
#include "drivers/replay/source.hpp"

namespace shaker::drivers::replay {

// An Error names the file or the signal. Lines that do not parse are counted as malformed and
// skipped.
Result<std::unique_ptr<Source>> open_candump(const config::ReplaySensor& config,
                                             const std::filesystem::path& directory);

}  // namespace shaker::drivers::replay
