#include "drivers/factory.hpp"

#include <type_traits>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "drivers/can/can_exciter.hpp"
#include "drivers/can/can_sensor.hpp"

namespace shaker::drivers {
namespace {

using MadeExciter = Result<std::unique_ptr<Exciter>>;
using MadeSensor = Result<std::unique_ptr<Sensor>>;

Error not_built(const char* what) {
  return Error{
      ErrorKind::invalid,
      fmt::format("this build has no {} driver: name another device in the rig file", what)};
}

// One row per driver: how its part of the rig file becomes a device.
struct ExciterRows {
  const config::RigConfig& rig;
  Clock& clock;

  MadeExciter operator()(const config::ModbusExciter&) const { return not_built("Modbus exciter"); }
  MadeExciter operator()(const config::CanExciter& exciter) const {
    return can::make_can_exciter(exciter, rig.exciter.heartbeat_period_s, rig.directory, clock);
  }
  MadeExciter operator()(const config::SimulatedExciter&) const {
    return not_built("simulated exciter");
  }
  MadeExciter operator()(const config::ReplayExciter&) const { return not_built("replay exciter"); }
};

struct SensorRows {
  const config::RigConfig& rig;
  Clock& clock;

  MadeSensor operator()(const config::CanSensor& sensor) const {
    return can::make_can_sensor(sensor, rig.directory, clock);
  }
  MadeSensor operator()(const config::ModbusSensor&) const { return not_built("Modbus sensor"); }
  MadeSensor operator()(const config::SimulatedSensor&) const {
    return not_built("simulated sensor");
  }
  MadeSensor operator()(const config::ReplaySensor&) const { return not_built("replay sensor"); }
};

Error in_place(const std::string& place, const Error& error) {
  return Error{error.kind, place + ": " + error.what};
}

}  // namespace

Result<Devices> make_devices(const config::RigConfig& rig, Clock& clock) {
  Devices devices;
  MadeExciter exciter = std::visit(ExciterRows{rig, clock}, rig.exciter.device);
  if (!exciter) return in_place("exciter", exciter.error());
  devices.exciter = std::move(*exciter);
  for (std::size_t i = 0; i < rig.sensors.size(); ++i) {
    MadeSensor sensor = std::visit(SensorRows{rig, clock}, rig.sensors[i]);
    if (!sensor) return in_place(fmt::format("sensors[{}]", i), sensor.error());
    devices.sensors.push_back(std::move(*sensor));
  }
  return devices;
}

}  // namespace shaker::drivers
