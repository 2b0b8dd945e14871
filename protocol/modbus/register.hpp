// One value in a Modbus device's register table: where it stands and how its bits are read.
//
// The codec is ours because libmodbus' float helpers do not round-trip (modbus_set_float_abcd(1.0f)
// gives 803F 0000). Pure: words in, value out.
// Source: Modbus Application Protocol V1.1b3; word orders named as device manuals do (A = most
// significant byte of a 32-bit value).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "base/result.hpp"

namespace shaker::protocol::modbus {

enum class RegisterType { u16, i16, u32, i32, f32 };
enum class WordOrder { abcd, cdab, badc, dcba };
enum class RegisterTable { holding, input };

// value = raw * scale + offset, in `unit`.
struct RegisterSpec {
  RegisterTable table = RegisterTable::holding;
  int address = 0;  // 0-based, as on the wire
  RegisterType type = RegisterType::u16;
  WordOrder order = WordOrder::abcd;
  double scale = 1.0;
  double offset = 0.0;
  std::string unit;
  bool cyclic = false;  // may be written every period (others wear out an EEPROM: only on change)
};

// 1 or 2 registers.
int word_count(RegisterType type);

// An Error when the address lies outside of 0..65535 (both words of a 32-bit value), or scale or
// offset make no sense. Everything below presumes a spec that passed.
Result<void> validate(const RegisterSpec& spec);

// Precondition: words.size() == word_count(spec.type).
double decode(const RegisterSpec& spec, std::span<const std::uint16_t> words);

// Rounds to the nearest representable raw value. An Error when the value is not finite or does not
// fit, naming the value and the range that fits.
Result<void> encode(const RegisterSpec& spec, double value, std::span<std::uint16_t> words);

// The bits as they stand, put into the type's word order: for masks (status, fault).
std::uint32_t bits(const RegisterSpec& spec, std::span<const std::uint16_t> words);

// The step between representable values near `value`, in `unit`: what a read-back may differ by.
double resolution(const RegisterSpec& spec, double value);

}  // namespace shaker::protocol::modbus
