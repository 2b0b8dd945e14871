// A unique name of an exciter on this PC. It is the same for every rig file that reaches the
// exciter, independent of how the file writes the address.
//
//   Modbus TCP  the numeric address, port and unit; every address of this PC itself is "this-pc"
//   Modbus RTU  the device's number (so that symbolic links do not matter) and unit; the path while
//               the device is not plugged in (a serial line has a lock of its own besides:
//               dial.cpp)
//   CAN         the interface and the identifier of the setpoint message
//
// A gateway or a router that gives one device a second address is not recognised.
#pragma once

#include <optional>
#include <string>

#include "base/result.hpp"
#include "config/rig.hpp"

namespace shaker::daemon {

// The result can be part of a file name. It is empty for a device that moves nothing outside
// this process (simulated, replay). An Error concerns the DBC file. Reads that file and queries
// the kernel; sends nothing.
Result<std::optional<std::string>> exciter_address(const config::RigConfig& rig);

}  // namespace shaker::daemon
