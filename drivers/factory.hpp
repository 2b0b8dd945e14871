// From a rig file to open-able devices: the one table in which every driver has its row.
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

// Opens nothing yet. `clock` must outlive the devices. A simulated exciter and sensor share one
// virtual rig that lives on `clock`.
Result<Devices> make_devices(const config::RigConfig& rig, Clock& clock);

// The exciter alone: what a stop needs, whatever is wrong with the sensors.
Result<std::unique_ptr<Exciter>> make_exciter(const config::RigConfig& rig, Clock& clock);

}  // namespace shaker::drivers
