// A set of registers of one device that are read together.
//
// Holds the plan and the buffers, so that reading does not allocate. One thread.
#pragma once

#include <span>
#include <vector>

#include "base/result.hpp"
#include "drivers/modbus/connection.hpp"
#include "protocol/modbus/block.hpp"

namespace shaker::drivers::modbus {

class RegisterSet {
 public:
  // Precondition: every spec passed protocol::modbus::validate.
  explicit RegisterSet(std::vector<protocol::modbus::RegisterSpec> specs);

  std::size_t size() const { return specs_.size(); }
  const protocol::modbus::RegisterSpec& spec(std::size_t i) const { return specs_[i]; }

  // Uses as few requests as possible; returns at the first that fails.
  Result<void> read(ModbusConnection& connection);

  // The requested blocks, and their registers as last read (a replay writes the registers of
  // its log there).
  std::span<const protocol::modbus::Block> blocks() const { return plan_.blocks; }
  std::span<std::uint16_t> buffer(std::size_t block) { return buffers_[block]; }
  std::span<const std::uint16_t> buffer(std::size_t block) const { return buffers_[block]; }

  // The register i as last read: raw words, value, bits.
  std::span<const std::uint16_t> words(std::size_t i) const;
  double value(std::size_t i) const;
  std::uint32_t bits(std::size_t i) const;

 private:
  std::vector<protocol::modbus::RegisterSpec> specs_;
  protocol::modbus::Plan plan_;
  std::vector<std::vector<std::uint16_t>> buffers_;  // one for each block
};

}  // namespace shaker::drivers::modbus
