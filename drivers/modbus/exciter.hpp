// An exciter behind a Modbus register map: setpoints written and read back, a heartbeat, a stop.
//
// The map comes from the rig file, by role (config/rig.hpp; drivers/modbus/README.md says how to
// write one). What the driver promises beyond the port's contract:
// - It writes only what changed: registers of many drives are EEPROM cells with 10 000 writes. Only
//   the heartbeat is written for ever, so its register must be marked cyclic.
// - Enable goes last when it rises and first when it falls.
// - A setpoint that reads back as something else is an Error.
// - After a reconnect it reads what the device holds before it trusts its own memory.
#pragma once

#include <memory>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "config/rig.hpp"
#include "drivers/exciter.hpp"

namespace shaker::drivers::modbus {

// Opens nothing yet. An Error names the role or setting that is wrong. `clock` must outlive it.
Result<std::unique_ptr<Exciter>> make_exciter(const config::ModbusExciter& config, Clock& clock);

}  // namespace shaker::drivers::modbus
