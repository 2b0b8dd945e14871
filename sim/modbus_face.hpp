// Serves a RegisterMap as a Modbus server: over TCP to several clients, or as RTU over a
// pseudo-terminal. libmodbus frames the messages. There is no thread inside; the owner calls
// `watch` and `serve` around its poll().
//
// Unit 1 is the exciter's controller; on TCP the units 0 and 255 are the same. Unit 2 is the
// sensors, on TCP only. A silent device does not answer: the fault exciter_silent silences unit
// 1, sensor_silent silences unit 2.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <modbus/modbus.h>
#include <poll.h>

#include "base/result.hpp"
#include "base/unique_fd.hpp"
#include "sim/register_map.hpp"

namespace shaker::sim {

struct ModbusRelease {
  void operator()(modbus_t* context) const { modbus_free(context); }
  void operator()(modbus_mapping_t* mapping) const { modbus_mapping_free(mapping); }
};

class ModbusFace {
 public:
  virtual ~ModbusFace() = default;
  // Appends the descriptors to poll.
  virtual void watch(std::vector<pollfd>& wanted) const = 0;
  // Answers what has arrived on a descriptor from `watch`. Ignores other descriptors. Waits at
  // most 20 ms for the next bytes of an incomplete message.
  virtual void serve(const pollfd& ready) = 0;

  static constexpr std::size_t kMostClients = 16;
  // Listens on `port`; 0 chooses a free one. `map` and `rig` must outlive the face.
  static Result<std::unique_ptr<ModbusFace>> tcp(RegisterMap& map, VirtualRig& rig,
                                                 const std::string& address, int port);
  // Creates a pseudo-terminal and a symbolic link to it. Replaces an old link, but no other
  // file. The face removes the link when it is destroyed.
  static Result<std::unique_ptr<ModbusFace>> pty(RegisterMap& map, VirtualRig& rig,
                                                 const std::string& link);
  // The address or the link: "127.0.0.1:1502", "/tmp/rig".
  virtual std::string place() const = 0;
  virtual int port() const { return 0; }
};

}  // namespace shaker::sim
