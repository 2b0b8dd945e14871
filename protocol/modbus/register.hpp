// One value in a Modbus device's register table: its place and its codec.
//
// The codec of libmodbus is not used, because its float helpers do not round-trip
// (modbus_set_float_abcd(1.0f) gives 803F 0000). Pure: words in, value out. Source: Modbus
// Application Protocol V1.1b3; word orders are named as in device manuals (A = most significant
// byte of a 32-bit value).
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
  bool cyclic = false;  // may be written continuously (others are EEPROM: only on change)
};

// Number of registers: 1 or 2.
int word_count(RegisterType type);

// Returns an Error if the address (both words of a 32-bit value) is outside 0..65535, or if
// scale or offset is invalid. All functions below require a valid spec.
Result<void> validate(const RegisterSpec& spec);

// Precondition: words.size() == word_count(spec.type).
double decode(const RegisterSpec& spec, std::span<const std::uint16_t> words);

// Rounds to the nearest representable raw value. Returns an Error if the value is not finite or
// does not fit; it names the value and the range that fits.
Result<void> encode(const RegisterSpec& spec, double value, std::span<std::uint16_t> words);

// The raw bits in the type's word order; for masks (status, fault).
std::uint32_t bits(const RegisterSpec& spec, std::span<const std::uint16_t> words);

// The step between representable values near `value`, in `unit`: the tolerance of a read-back.
double resolution(const RegisterSpec& spec, double value);

}  // namespace shaker::protocol::modbus
