#include "sim/modbus_desk.hpp"

#include <algorithm>
#include <array>
#include <vector>

namespace shaker::sim {
namespace {

constexpr std::uint8_t kReadHolding = 3, kReadInput = 4, kWriteOne = 6, kWriteMany = 16;
// "Gateway target device failed to respond": the answer of a gateway for a unit that does not
// exist.
constexpr int kNoSuchUnit = 11;

std::uint16_t word(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}

}  // namespace

ModbusDesk::ModbusDesk(RegisterMap& map, VirtualRig& rig, bool serial)
    : map_(map),
      rig_(rig),
      serial_(serial),
      mapping_(modbus_mapping_new(0, 0, Holding::count, Input::count)) {}

ModbusDesk::Unit ModbusDesk::unit(std::uint8_t id) const {
  if (id == 1 || (!serial_ && (id == 0 || id == 255))) return Unit::controller;
  return id == 2 && !serial_ ? Unit::sensors : Unit::nobody;
}

// Executes a write request. Returns the exception code, or 0.
int ModbusDesk::write(std::span<const std::uint8_t> pdu) {
  const int address = word(pdu, 1);
  std::vector<std::uint16_t> words;
  if (pdu[0] == kWriteOne) {
    words.push_back(word(pdu, 3));
  } else {
    const std::size_t count = word(pdu, 3);
    if (count == 0 || count > MODBUS_MAX_WRITE_REGISTERS || pdu.size() < 6 + 2 * count ||
        pdu[5] != 2 * count) {
      return static_cast<int>(Refusal::illegal_value);
    }
    for (std::size_t i = 0; i < count; ++i)
      words.push_back(word(pdu, 6 + 2 * i));
  }
  return static_cast<int>(map_.write(address, words));
}

int ModbusDesk::refusal(Unit asked, std::span<const std::uint8_t> pdu) {
  if (asked == Unit::nobody) return kNoSuchUnit;
  const std::uint8_t function = pdu[0];
  if (function == kReadHolding || function == kReadInput) return 0;
  const bool writes = function == kWriteOne || function == kWriteMany;
  if (!writes || asked == Unit::sensors) return MODBUS_EXCEPTION_ILLEGAL_FUNCTION;
  return write(pdu);
}

bool ModbusDesk::answer(modbus_t* context) {
  std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> query{};
  const int length = modbus_receive(context, query.data());
  if (length == 0) return true;  // on a serial line: the request was for another unit
  const int header = modbus_get_header_length(context);
  if (length < header + 5) return false;
  const Unit asked = unit(query[static_cast<std::size_t>(header) - 1]);
  const Fault fault = rig_.injected();
  if ((asked == Unit::controller && fault == Fault::exciter_silent) ||
      (asked == Unit::sensors && fault == Fault::sensor_silent)) {
    return true;
  }
  const auto pdu = std::span<const std::uint8_t>(query).subspan(
      static_cast<std::size_t>(header), static_cast<std::size_t>(length - header));
  if (const int code = refusal(asked, pdu); code != 0) {
    return modbus_reply_exception(context, query.data(), static_cast<unsigned>(code)) >= 0;
  }
  std::ranges::copy(map_.holding(), mapping_->tab_registers);
  std::ranges::copy(map_.input(), mapping_->tab_input_registers);
  return modbus_reply(context, query.data(), length, mapping_.get()) >= 0;
}

}  // namespace shaker::sim
