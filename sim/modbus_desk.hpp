// Answers one Modbus request, over TCP or a serial line.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "sim/modbus_face.hpp"

namespace shaker::sim {

class ModbusDesk {
 public:
  ModbusDesk(RegisterMap& map, VirtualRig& rig, bool serial);
  // Receives the request that waits on the context's socket and answers it; a device that an
  // injected fault has silenced does not answer. Returns false when the client has gone or has
  // sent an invalid request.
  bool answer(modbus_t* context);

 private:
  enum class Unit { controller, sensors, nobody };
  Unit unit(std::uint8_t id) const;
  int refusal(Unit unit, std::span<const std::uint8_t> pdu);
  int write(std::span<const std::uint8_t> pdu);

  RegisterMap& map_;
  VirtualRig& rig_;
  bool serial_;
  std::unique_ptr<modbus_mapping_t, ModbusRelease> mapping_;
};

}  // namespace shaker::sim
