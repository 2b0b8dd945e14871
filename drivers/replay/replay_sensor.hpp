// A sensor that gives again what was recorded: a campaign database, or a `candump -l` log with its
// DBC file.
//
// Stamps keep their recorded distances and begin at the time of connect(), whatever the speed: a
// campaign that is replayed ten times as fast still has the frequency that it had. speed 0 gives
// samples as fast as they are read; speed N makes read() wait, on the given clock, until a sample
// is due. finished() after the last one.
#pragma once

#include <filesystem>
#include <memory>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "config/rig.hpp"
#include "drivers/sensor.hpp"

namespace shaker::drivers::replay {

// Opens the recording (relative to `directory`). `clock` must outlive the sensor.
Result<std::unique_ptr<Sensor>> make_replay_sensor(const config::ReplaySensor& config,
                                                   const std::filesystem::path& directory,
                                                   Clock& clock);

}  // namespace shaker::drivers::replay
