// A sensor that polls displacement (and excitation) from Modbus registers.
//
// It polls at rate_hz on absolute deadlines, with neighbouring registers in one request. If the
// map has a time stamp, the device stamps the samples (StampSource::device, see
// device_clock.hpp), and a stamp that was seen before gives no samples. Otherwise the stamp is
// the middle between request and answer on our own clock (StampSource::host_receive). A value
// that is not finite gives a sample of bad quality. A missed answer is counted and gives no
// samples; read() returns an Error only if the connection is lost.
#pragma once

#include <filesystem>
#include <memory>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "config/rig.hpp"
#include "drivers/sensor.hpp"

namespace shaker::drivers::modbus {

// Does not connect. An Error names the invalid channel or setting. `clock` must outlive the
// sensor.
Result<std::unique_ptr<Sensor>> make_sensor(const config::ModbusSensor& config, Clock& clock,
                                            const std::filesystem::path& directory = {});

}  // namespace shaker::drivers::modbus
