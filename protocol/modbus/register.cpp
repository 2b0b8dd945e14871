#include "protocol/modbus/register.hpp"

#include <bit>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace shaker::protocol::modbus {
namespace {

struct Range {
  double low, high;
};

Range raw_range(RegisterType type) {
  switch (type) {
    case RegisterType::u16:
      return {0.0, 65535.0};
    case RegisterType::i16:
      return {-32768.0, 32767.0};
    case RegisterType::u32:
      return {0.0, 4294967295.0};
    case RegisterType::i32:
      return {-2147483648.0, 2147483647.0};
    case RegisterType::f32:
      break;
  }
  constexpr double most = static_cast<double>(std::numeric_limits<float>::max());
  return {-most, most};
}

const char* type_name(RegisterType type) {
  switch (type) {
    case RegisterType::u16:
      return "u16";
    case RegisterType::i16:
      return "i16";
    case RegisterType::u32:
      return "u32";
    case RegisterType::i32:
      return "i32";
    case RegisterType::f32:
      break;
  }
  return "f32";
}

std::uint16_t swap_bytes(std::uint16_t word) {
  return static_cast<std::uint16_t>(word << 8 | word >> 8);
}

bool words_swapped(WordOrder order) {
  return order == WordOrder::cdab || order == WordOrder::dcba;
}
bool bytes_swapped(WordOrder order) {
  return order == WordOrder::badc || order == WordOrder::dcba;
}

// A 16-bit register has no word order. Its bytes are in wire order (big-endian) whatever the
// order of the device's 32-bit values, so `order` is ignored.
void put(const RegisterSpec& spec, std::uint32_t raw, std::span<std::uint16_t> words) {
  if (word_count(spec.type) == 1) {
    words[0] = static_cast<std::uint16_t>(raw);
    return;
  }
  std::uint16_t high = static_cast<std::uint16_t>(raw >> 16);
  std::uint16_t low = static_cast<std::uint16_t>(raw);
  if (bytes_swapped(spec.order)) {
    high = swap_bytes(high);
    low = swap_bytes(low);
  }
  const bool swapped = words_swapped(spec.order);
  words[0] = swapped ? low : high;
  words[1] = swapped ? high : low;
}

double raw_value(RegisterType type, std::uint32_t raw) {
  switch (type) {
    case RegisterType::u16:
      return raw;
    case RegisterType::i16:
      return static_cast<std::int16_t>(raw);
    case RegisterType::u32:
      return raw;
    case RegisterType::i32:
      return static_cast<std::int32_t>(raw);
    case RegisterType::f32:
      break;
  }
  return static_cast<double>(std::bit_cast<float>(raw));
}

}  // namespace

int word_count(RegisterType type) {
  return type == RegisterType::u16 || type == RegisterType::i16 ? 1 : 2;
}

Result<void> validate(const RegisterSpec& spec) {
  const int last = 65536 - word_count(spec.type);
  if (spec.address < 0 || spec.address > last) {
    return Error{ErrorKind::invalid,
                 fmt::format("register address {} of a {} must lie in 0..{} (0-based, as on the "
                             "wire: holding register 40001 is address 0)",
                             spec.address, type_name(spec.type), last)};
  }
  if (!std::isfinite(spec.scale) || spec.scale == 0.0 || !std::isfinite(spec.offset)) {
    return Error{ErrorKind::invalid,
                 fmt::format("register {}: scale {} must be finite and not 0, offset {} finite",
                             spec.address, spec.scale, spec.offset)};
  }
  return {};
}

std::uint32_t bits(const RegisterSpec& spec, std::span<const std::uint16_t> words) {
  if (word_count(spec.type) == 1) return words[0];
  const bool swapped = words_swapped(spec.order);
  std::uint16_t high = words[swapped ? 1 : 0];
  std::uint16_t low = words[swapped ? 0 : 1];
  if (bytes_swapped(spec.order)) {
    high = swap_bytes(high);
    low = swap_bytes(low);
  }
  return static_cast<std::uint32_t>(high) << 16 | low;
}

double decode(const RegisterSpec& spec, std::span<const std::uint16_t> words) {
  return raw_value(spec.type, bits(spec, words)) * spec.scale + spec.offset;
}

Result<void> encode(const RegisterSpec& spec, double value, std::span<std::uint16_t> words) {
  const Range range = raw_range(spec.type);
  double raw = (value - spec.offset) / spec.scale;
  if (spec.type != RegisterType::f32) raw = std::nearbyint(raw);
  if (!std::isfinite(value) || !(raw >= range.low && raw <= range.high)) {
    const double a = range.low * spec.scale + spec.offset;
    const double b = range.high * spec.scale + spec.offset;
    return Error{ErrorKind::invalid,
                 fmt::format("register {}: {:g}{}{} does not fit its {}: allowed is {:g} to {:g}",
                             spec.address, value, spec.unit.empty() ? "" : " ", spec.unit,
                             type_name(spec.type), std::fmin(a, b), std::fmax(a, b))};
  }
  switch (spec.type) {
    case RegisterType::f32:
      put(spec, std::bit_cast<std::uint32_t>(static_cast<float>(raw)), words);
      break;
    case RegisterType::u32:
      put(spec, static_cast<std::uint32_t>(raw), words);
      break;
    default:
      put(spec, static_cast<std::uint32_t>(static_cast<std::int32_t>(raw)), words);
      break;
  }
  return {};
}

double resolution(const RegisterSpec& spec, double value) {
  if (spec.type != RegisterType::f32) return std::abs(spec.scale);
  const float raw = static_cast<float>((value - spec.offset) / spec.scale);
  const float magnitude = std::fmax(std::abs(raw), std::numeric_limits<float>::min());
  const float next = std::nextafter(magnitude, std::numeric_limits<float>::infinity());
  // Two steps: one for the single-precision arithmetic of each side.
  return 2.0 * static_cast<double>(next - magnitude) * std::abs(spec.scale);
}

}  // namespace shaker::protocol::modbus
