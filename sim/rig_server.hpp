// Runs a virtual rig in real time behind Modbus and CAN. One thread.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "base/clock.hpp"
#include "sim/can_face.hpp"
#include "sim/modbus_face.hpp"

namespace shaker::sim {

// A fault and the time after the start at which the server injects it.
struct ScriptedFault {
  Fault fault = Fault::none;
  double at_s = 0.0;  // s after the start
};

class RigServer {
 public:
  RigServer(const RigOptions& options, std::vector<ScriptedFault> script);

  // Each returns an Error when the port, the link or the interface cannot be opened.
  Result<void> open_tcp(const std::string& address, int port);
  Result<void> open_pty(const std::string& link);
  // With `auxiliary` it also sends the auxiliary quantities.
  Result<void> open_can(const std::string& interface, bool auxiliary = false);

  const std::vector<std::unique_ptr<ModbusFace>>& modbus() const { return modbus_; }
  const VirtualRig& rig() const { return rig_; }

  // Serves until `stop_fd` becomes readable. Blocks.
  void run(int stop_fd);

 private:
  void catch_up();
  void play_script(Nanoseconds now);
  Nanoseconds next_event() const;

  RealClock clock_;
  Nanoseconds start_;
  VirtualRig rig_;
  RegisterMap map_;
  std::vector<std::unique_ptr<ModbusFace>> modbus_;
  std::optional<CanFace> can_;
  bool send_auxiliary_ = false;
  std::vector<ScriptedFault> script_;  // in time order
  std::size_t played_ = 0;
  Nanoseconds next_status_{};
  std::vector<RigSample> samples_;
};

}  // namespace shaker::sim
