// A sensor that replays a recording: a campaign database, a `candump -l` log with its DBC file,
// or a log of Modbus polls.
//
// Stamps keep their recorded distances and begin at the time of connect(), whatever the speed:
// a campaign that is replayed ten times as fast keeps its frequency. speed 0 delivers samples
// as fast as they are read; speed N makes read() wait, on the given clock, until a sample is
// due. finished() is true after the last one.
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
