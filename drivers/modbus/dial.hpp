// Opens the wire to a Modbus device: a TCP connection that gives up in time, or a serial line of
// its own.
//
// Apart from libmodbus' own connect because that one aborts the process in select() when the
// descriptor is 1024 or more, and asks a name server when given a name. One thread; `dial` blocks
// at most `timeout`.
#pragma once

#include <memory>
#include <string>

#include <modbus/modbus.h>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "config/rig.hpp"

namespace shaker::drivers::modbus {

struct FreeContext {
  void operator()(modbus_t* context) const {
    modbus_close(context);
    modbus_free(context);
  }
};
using Context = std::unique_ptr<modbus_t, FreeContext>;

// "Modbus TCP 127.0.0.1:502 unit 1", "Modbus RTU /dev/ttyUSB0 19200 8E1 unit 1".
std::string describe(const config::ModbusLink& link);

// An Error names the setting, its value and what is allowed.
Result<void> validate(const config::ModbusLink& link);

// A connected context. An Error when nobody answers there, or the line is in use. Precondition:
// validate(link) passed.
Result<Context> dial(const config::ModbusLink& link, Nanoseconds timeout);

}  // namespace shaker::drivers::modbus
