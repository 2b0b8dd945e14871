#include "drivers/modbus/register_set.hpp"

#include <utility>

namespace shaker::drivers::modbus {

RegisterSet::RegisterSet(std::vector<protocol::modbus::RegisterSpec> specs)
    : specs_(std::move(specs)), plan_(protocol::modbus::plan_reads(specs_)) {
  for (const protocol::modbus::Block& block : plan_.blocks) {
    buffers_.emplace_back(static_cast<std::size_t>(block.words));
  }
}

Result<void> RegisterSet::read(ModbusConnection& connection) {
  for (std::size_t i = 0; i < plan_.blocks.size(); ++i) {
    if (Result<void> done = connection.read(plan_.blocks[i], buffers_[i]); !done) return done;
  }
  return {};
}

std::span<const std::uint16_t> RegisterSet::words(std::size_t i) const {
  const protocol::modbus::Placement place = plan_.placements[i];
  const auto count = static_cast<std::size_t>(protocol::modbus::word_count(specs_[i].type));
  return std::span(buffers_[static_cast<std::size_t>(place.block)])
      .subspan(static_cast<std::size_t>(place.offset), count);
}

double RegisterSet::value(std::size_t i) const {
  return protocol::modbus::decode(specs_[i], words(i));
}

std::uint32_t RegisterSet::bits(std::size_t i) const {
  return protocol::modbus::bits(specs_[i], words(i));
}

}  // namespace shaker::drivers::modbus
