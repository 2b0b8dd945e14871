// An exciter with a Modbus register map: setpoints that are written and read back, a heartbeat,
// a stop.
//
// The rig file gives the map by role (config/rig.hpp; drivers/modbus/README.md explains how to
// write one). In addition to the port's contract, the driver guarantees:
// - It writes changed values only, because registers of many drives are EEPROM cells with 10 000
//   writes. Only the heartbeat is written continuously, so its register must be marked cyclic.
// - Enable is written last when it rises and first when it falls.
// - A setpoint that reads back as another value is an Error.
// - After a reconnect it reads what the device holds before it relies on its own memory.
#pragma once

#include <memory>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "config/rig.hpp"
#include "drivers/exciter.hpp"

namespace shaker::drivers::modbus {

// Does not connect. An Error names the invalid role or setting. `clock` must outlive the
// exciter.
Result<std::unique_ptr<Exciter>> make_exciter(const config::ModbusExciter& config, Clock& clock);

}  // namespace shaker::drivers::modbus
