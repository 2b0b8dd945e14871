// Serves a RegisterMap as a Modbus server, over TCP to several clients or over a pseudo-terminal as
// RTU (libmodbus frames the messages). One thread, driven by the owner's poll().
//
// Units: 1 is the exciter's controller (on TCP 0 and 255 are it too), 2 the sensors, TCP only. A
// silent device does not answer: fault exciter_silent silences unit 1, sensor_silent unit 2.
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
  // What to wait for.
  virtual void watch(std::vector<pollfd>& wanted) const = 0;
  // Answers what has arrived on the descriptor of a `watch`; others are ignored.
  virtual void serve(const pollfd& ready) = 0;

  static constexpr std::size_t kMostClients = 16;
  // port 0: any free one. `map` must outlive the face.
  static Result<std::unique_ptr<ModbusFace>> tcp(RegisterMap& map, VirtualRig& rig,
                                                 const std::string& address, int port);
  // Makes a pseudo-terminal and a symbolic link to it, replacing an old link; removes it at the
  // end.
  static Result<std::unique_ptr<ModbusFace>> pty(RegisterMap& map, VirtualRig& rig,
                                                 const std::string& link);
  // "127.0.0.1:1502", "/tmp/rig"
  virtual std::string place() const = 0;
  virtual int port() const { return 0; }
};

}  // namespace shaker::sim
