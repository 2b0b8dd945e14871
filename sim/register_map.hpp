// The Modbus registers of the virtual rig; sim/README.md has the table. This file uses no
// sockets and no libmodbus.
//
// 32-bit values take two registers, most significant word first (ABCD). They are packed here,
// so that the daemon's codec is tested against an independent implementation.
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

// Exception codes of the Modbus Application Protocol V1.1b3, chapter 7; 0 means success.
enum class Refusal { none = 0, illegal_address = 2, illegal_value = 3, device_failure = 4 };

class RegisterMap {
 public:
  explicit RegisterMap(VirtualRig& rig) : rig_(rig) {}

  // Writes `words` to the holding registers from `address` on. It writes nothing when an
  // address or a value is refused; half of a 32-bit value is an illegal address. Enabling acts
  // last, so that a block write never starts with the old ramp; disabling acts first. Returns
  // device_failure when the rig refuses a value that is in range.
  Refusal write(int address, std::span<const std::uint16_t> words);

  void show(const RigSample& sample) { newest_ = sample; }
  std::array<std::uint16_t, Holding::count> holding() const;
  std::array<std::uint16_t, Input::count> input() const;

 private:
  VirtualRig& rig_;
  RigSample newest_{};
};

}  // namespace shaker::sim
