// The virtual rig's Modbus registers: sim/README.md has the table. Pure: no sockets, no libmodbus.
//
// 32-bit values take two registers, most significant word first (ABCD). They are packed here, in
// lines of our own, so that the daemon's codec is tested against something else than itself.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "sim/virtual_rig.hpp"

namespace shaker::sim {

// Addresses, from 0 as on the wire.
struct Holding {
  static constexpr int frequency = 0, amplitude = 2, enable = 4, ramp = 5, heartbeat = 7,
                       heartbeat_timeout = 8, fault_reset = 10, inject = 11, count = 12;
};
struct Input {
  static constexpr int status = 0, fault = 1, frequency_actual = 2, amplitude_actual = 4,
                       displacement = 6, excitation = 8, stamp_us = 10, counter = 12,
                       auxiliary = 14, count = auxiliary + 2 * static_cast<int>(kAuxiliaryMost);
};

// Exception codes of the Modbus Application Protocol V1.1b3, chapter 7; 0: done.
enum class Refusal { none = 0, illegal_address = 2, illegal_value = 3, device_failure = 4 };

class RegisterMap {
 public:
  explicit RegisterMap(VirtualRig& rig) : rig_(rig) {}

  // All or nothing. Half of a 32-bit value is refused. Enable acts last, so that a block write
  // never starts on an old ramp.
  Refusal write(int address, std::span<const std::uint16_t> words);

  void show(const RigSample& sample) { newest_ = sample; }
  std::array<std::uint16_t, Holding::count> holding() const;
  std::array<std::uint16_t, Input::count> input() const;

 private:
  VirtualRig& rig_;
  RigSample newest_{};
};

}  // namespace shaker::sim
