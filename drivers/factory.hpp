// Makes the devices of a rig file. This is the one table in which every driver has its row.
#pragma once

#include <memory>
#include <vector>

#include "base/clock.hpp"
#include "config/rig.hpp"
#include "drivers/exciter.hpp"
#include "drivers/sensor.hpp"

namespace shaker::drivers {

struct Devices {
  std::unique_ptr<Exciter> exciter;
  std::vector<std::unique_ptr<Sensor>> sensors;
};

// Does not open a device. `clock` must outlive the devices. A simulated exciter and sensor
// share one virtual rig on `clock`. An Error names the place in the rig file.
Result<Devices> make_devices(const config::RigConfig& rig, Clock& clock);

// The exciter only, as a stop needs it, independent of errors in the sensors.
Result<std::unique_ptr<Exciter>> make_exciter(const config::RigConfig& rig, Clock& clock);

}  // namespace shaker::drivers
