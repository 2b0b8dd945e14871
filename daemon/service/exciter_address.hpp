// What an exciter is called on this PC: the same for every rig file that reaches it, however the
// file writes the way there.
//
//   Modbus TCP  the numeric address, port and unit; every address of this PC itself is "this-pc"
//   Modbus RTU  the device's number (so that symbolic links do not matter) and unit; the path while
//               the device is not plugged in (a serial line has a lock of its own besides:
//               dial.cpp)
//   CAN         the interface and the identifier of the setpoint message
//
// Not seen through: a gateway or a router that gives one device a second address.
#pragma once

#include <optional>
#include <string>

#include "base/result.hpp"
#include "config/rig.hpp"

namespace shaker::daemon {

// Fit for a file's name. Nothing: a device that moves nothing outside this process (simulated,
// replay). An Error is about the DBC file. Reads that file, asks the kernel, sends nothing.
Result<std::optional<std::string>> exciter_address(const config::RigConfig& rig);

}  // namespace shaker::daemon
