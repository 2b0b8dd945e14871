// Opens the link to a Modbus device: a TCP connection with a timeout, or an exclusive serial
// line.
//
// Replaces the TCP connect of libmodbus, which aborts the process in select() if the descriptor
// is 1024 or more, and queries a name server for a name. One thread; `dial` blocks at most
// `timeout` on TCP.
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

// An Error names the setting, its value and the allowed values.
Result<void> validate(const config::ModbusLink& link);

// Returns a connected context, or an Error if nobody answers or the line is in use.
// Precondition: validate(link) passed.
Result<Context> dial(const config::ModbusLink& link, Nanoseconds timeout);

}  // namespace shaker::drivers::modbus
