#include "drivers/factory.hpp"

#include <utility>
#include <variant>

#include <fmt/format.h>

#include "drivers/can/can_exciter.hpp"
#include "drivers/can/can_sensor.hpp"
#include "drivers/modbus/exciter.hpp"
#include "drivers/modbus/sensor.hpp"
#include "drivers/replay/replay_exciter.hpp"
#include "drivers/replay/replay_sensor.hpp"
#include "drivers/sim/simulated_devices.hpp"

namespace shaker::drivers {
namespace {

using MadeExciter = Result<std::unique_ptr<Exciter>>;
using MadeSensor = Result<std::unique_ptr<Sensor>>;

// One row per driver: makes a device from its part of the rig file.
struct ExciterRows {
  const config::RigConfig& rig;
  Clock& clock;
  const std::shared_ptr<sim::SimulatedRig>& virtual_rig;

  MadeExciter operator()(const config::ModbusExciter& exciter) const {
    return modbus::make_exciter(exciter, clock);
  }
  MadeExciter operator()(const config::CanExciter& exciter) const {
    return can::make_can_exciter(exciter, rig.exciter.heartbeat_period_s, rig.directory, clock);
  }
  MadeExciter operator()(const config::SimulatedExciter&) const {
    if (!virtual_rig) {
      return Error{ErrorKind::invalid,
                   "a simulated exciter shakes what a simulated sensor measures: add one to "
                   "\"sensors\""};
    }
    return std::unique_ptr<Exciter>(std::make_unique<sim::SimulatedExciter>(virtual_rig));
  }
  MadeExciter operator()(const config::ReplayExciter&) const {
    return replay::make_replay_exciter(clock);
  }
};

struct SensorRows {
  const config::RigConfig& rig;
  Clock& clock;
  const std::shared_ptr<sim::SimulatedRig>& virtual_rig;

  MadeSensor operator()(const config::CanSensor& sensor) const {
    return can::make_can_sensor(sensor, rig.directory, clock);
  }
  MadeSensor operator()(const config::ModbusSensor& sensor) const {
    return modbus::make_sensor(sensor, clock, rig.directory);
  }
  MadeSensor operator()(const config::SimulatedSensor& sensor) const {
    std::vector<protocol::Channel> auxiliary;
    for (const auto& [channel, quantity] : sensor.auxiliary)
      auxiliary.push_back(channel);
    return std::unique_ptr<Sensor>(std::make_unique<sim::SimulatedSensor>(virtual_rig, auxiliary));
  }
  MadeSensor operator()(const config::ReplaySensor& sensor) const {
    return replay::make_replay_sensor(sensor, rig.directory, clock);
  }
};

// The virtual rig that the simulated exciter and sensor share; null if the rig file has none.
Result<std::shared_ptr<sim::SimulatedRig>> make_virtual_rig(const config::RigConfig& rig,
                                                            Clock& clock) {
  const config::SimulatedSensor* found = nullptr;
  for (const auto& sensor : rig.sensors) {
    const auto* simulated = std::get_if<config::SimulatedSensor>(&sensor);
    if (simulated && found) {
      return Error{ErrorKind::invalid,
                   "sensors: one simulated sensor gives both channels; remove the second"};
    }
    if (simulated) found = simulated;
  }
  if (!found) return std::shared_ptr<sim::SimulatedRig>();
  return sim::make_simulated_rig(*found, rig.exciter, clock);
}

Error in_place(const std::string& place, const Error& error) {
  return Error{error.kind, place + ": " + error.what};
}

MadeExciter make_exciter_on(const config::RigConfig& rig, Clock& clock,
                            const std::shared_ptr<sim::SimulatedRig>& virtual_rig) {
  MadeExciter exciter = std::visit(ExciterRows{rig, clock, virtual_rig}, rig.exciter.device);
  if (!exciter) return in_place("exciter", exciter.error());
  return exciter;
}

}  // namespace

Result<std::unique_ptr<Exciter>> make_exciter(const config::RigConfig& rig, Clock& clock) {
  const auto virtual_rig = make_virtual_rig(rig, clock);
  if (!virtual_rig) return virtual_rig.error();
  return make_exciter_on(rig, clock, *virtual_rig);
}

Result<Devices> make_devices(const config::RigConfig& rig, Clock& clock) {
  Devices devices;
  const auto virtual_rig = make_virtual_rig(rig, clock);
  if (!virtual_rig) return virtual_rig.error();
  MadeExciter exciter = make_exciter_on(rig, clock, *virtual_rig);
  if (!exciter) return exciter.error();
  devices.exciter = std::move(*exciter);
  for (std::size_t i = 0; i < rig.sensors.size(); ++i) {
    MadeSensor sensor = std::visit(SensorRows{rig, clock, *virtual_rig}, rig.sensors[i]);
    if (!sensor) return in_place(fmt::format("sensors[{}]", i), sensor.error());
    devices.sensors.push_back(std::move(*sensor));
  }
  return devices;
}

}  // namespace shaker::drivers
