// Displacement (and excitation) polled from Modbus registers.
//
// Polled at rate_hz on absolute deadlines, neighbours in one block read. Stamped by the device
// where its map has a time stamp (StampSource::device, see device_clock.hpp; a stamp that has been
// seen gives no samples), else with the middle between request and answer on our own clock
// (StampSource::host_receive). A value that is not
// finite comes as a sample of bad quality. A missed answer is counted and gives no samples; an
// Error comes only when the connection is gone.
#pragma once

#include <filesystem>
#include <memory>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "config/rig.hpp"
#include "drivers/sensor.hpp"

namespace shaker::drivers::modbus {

// Opens nothing yet. An Error names the channel or setting that is wrong. `clock` must outlive it.
Result<std::unique_ptr<Sensor>> make_sensor(const config::ModbusSensor& config, Clock& clock,
                                            const std::filesystem::path& directory = {});

}  // namespace shaker::drivers::modbus
