#include "protocol/can/signal.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace shaker::protocol::can {
namespace {

// Position of the signal's first bit in a numbering in which Motorola signals are contiguous:
// bit 7 of byte 0 is at 0. In it a Motorola signal occupies [first, first + length).
std::size_t motorola_first(const Signal& signal) {
  const auto start = static_cast<std::size_t>(signal.start_bit);
  return start / 8 * 8 + (7 - start % 8);
}

std::uint64_t mask(int length) {
  return length >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << length) - 1;
}

std::int64_t sign_extend(std::uint64_t raw, int length) {
  const int unused = 64 - length;
  return static_cast<std::int64_t>(raw << unused) >> unused;
}

// Calls visit(byte, shift in that byte, number of bits, weight of the lowest of them in the raw
// value) for each byte that contains a part of the signal.
template <class Visit>
void for_each_part(const Signal& signal, Visit visit) {
  int left = signal.length;
  if (signal.order == ByteOrder::intel) {
    auto at = static_cast<std::size_t>(signal.start_bit);
    for (int weight = 0; left > 0;) {
      const int shift = static_cast<int>(at % 8);
      const int count = std::min(left, 8 - shift);
      visit(at / 8, shift, count, weight);
      weight += count;
      left -= count;
      at += static_cast<std::size_t>(count);
    }
    return;
  }
  for (auto at = motorola_first(signal); left > 0;) {
    const int from_top = static_cast<int>(at % 8);
    const int count = std::min(left, 8 - from_top);
    left -= count;
    visit(at / 8, 8 - from_top - count, count, left);
    at += static_cast<std::size_t>(count);
  }
}

void put_bits(const Signal& signal, std::uint64_t raw, std::span<std::uint8_t> data) {
  for_each_part(signal, [&](std::size_t byte, int shift, int count, int weight) {
    const auto bits = static_cast<unsigned>(raw >> weight & mask(count));
    const auto keep = ~(static_cast<unsigned>(mask(count)) << shift);
    data[byte] = static_cast<std::uint8_t>((data[byte] & keep) | bits << shift);
  });
}

Error too_big(const Signal& signal, double value, double low, double high) {
  const double a = low * signal.factor + signal.offset, b = high * signal.factor + signal.offset;
  return {ErrorKind::invalid,
          fmt::format("signal {}: {} does not fit; its {} bits hold {} to {}", signal.name, value,
                      signal.length, std::min(a, b), std::max(a, b))};
}

Result<std::uint64_t> integer_bits(const Signal& signal, double value) {
  const double scaled = std::round((value - signal.offset) / signal.factor);
  const bool is_signed = signal.format == NumberFormat::signed_integer;
  const double low = is_signed ? -std::ldexp(1.0, signal.length - 1) : 0.0;
  const double past = std::ldexp(1.0, is_signed ? signal.length - 1 : signal.length);
  if (!(scaled >= low && scaled < past)) return too_big(signal, value, low, past - 1.0);
  if (is_signed) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(scaled)) & mask(signal.length);
  }
  return static_cast<std::uint64_t>(scaled);
}

}  // namespace

std::size_t bytes_needed(const Signal& signal) {
  const auto length = static_cast<std::size_t>(signal.length);
  const auto first = signal.order == ByteOrder::intel ? static_cast<std::size_t>(signal.start_bit)
                                                      : motorola_first(signal);
  return (first + length + 7) / 8;
}

std::optional<std::uint64_t> raw_bits(const Signal& signal, std::span<const std::uint8_t> data) {
  if (bytes_needed(signal) > data.size()) return std::nullopt;
  std::uint64_t raw = 0;
  for_each_part(signal, [&](std::size_t byte, int shift, int count, int weight) {
    raw |= (static_cast<std::uint64_t>(data[byte]) >> shift & mask(count)) << weight;
  });
  return raw;
}

std::optional<double> decode(const Signal& signal, std::span<const std::uint8_t> data) {
  const auto raw = raw_bits(signal, data);
  if (!raw) return std::nullopt;
  double value = 0.0;
  switch (signal.format) {
    case NumberFormat::unsigned_integer:
      value = static_cast<double>(*raw);
      break;
    case NumberFormat::signed_integer:
      value = static_cast<double>(sign_extend(*raw, signal.length));
      break;
    case NumberFormat::float32:
      value = static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(*raw)));
      break;
    case NumberFormat::float64:
      value = std::bit_cast<double>(*raw);
      break;
  }
  return value * signal.factor + signal.offset;
}

bool in_range(const Signal& signal, double value) {
  if (signal.minimum == 0.0 && signal.maximum == 0.0) return true;
  const double tolerance = 0.5 * std::abs(signal.factor);
  return value >= signal.minimum - tolerance && value <= signal.maximum + tolerance;
}

Result<void> encode(const Signal& signal, double value, std::span<std::uint8_t> data) {
  if (bytes_needed(signal) > data.size()) {
    return Error{ErrorKind::invalid,
                 fmt::format("signal {} needs a frame of {} bytes, this one has {}", signal.name,
                             bytes_needed(signal), data.size())};
  }
  if (!std::isfinite(value)) {
    return Error{
        ErrorKind::invalid,
        fmt::format("signal {}: {} cannot be sent, only finite numbers", signal.name, value)};
  }
  const double unscaled = (value - signal.offset) / signal.factor;
  if (signal.format == NumberFormat::float32) {
    constexpr auto largest = static_cast<double>(std::numeric_limits<float>::max());
    if (std::abs(unscaled) > largest) return too_big(signal, value, -largest, largest);
    put_bits(signal, std::bit_cast<std::uint32_t>(static_cast<float>(unscaled)), data);
  } else if (signal.format == NumberFormat::float64) {
    put_bits(signal, std::bit_cast<std::uint64_t>(unscaled), data);
  } else {
    const auto raw = integer_bits(signal, value);
    if (!raw) return raw.error();
    put_bits(signal, *raw, data);
  }
  return {};
}

}  // namespace shaker::protocol::can
