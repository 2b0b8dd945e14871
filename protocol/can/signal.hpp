// A signal: some bits of a CAN frame, read as a number.
//
// The two byte orders number their bits differently (PRACTICE and the DBC format):
//   Intel     start bit = the least significant one; following bits are start+1, start+2, ...
//   Motorola  start bit = the *most* significant one; within a byte the numbers fall from 7 to 0,
//             then go on at bit 7 of the next byte ("sawtooth").
// Bit n is bit n%8 (0 = least significant) of byte n/8. For the bytes 02 EF 70: 0|16 Intel is
// 61186, 7|16 Motorola is 751, 0|16 Motorola is 30648.
//
// Pure, no allocation, thread-safe. Never reads or writes outside the span it is given.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace shaker::protocol::can {

enum class ByteOrder : std::uint8_t { intel, motorola };
enum class NumberFormat : std::uint8_t { unsigned_integer, signed_integer, float32, float64 };

// The signal is in the frame only if the multiplexor's raw value is in one of the ranges.
struct Multiplexing {
  int multiplexor = -1;  // index in Message::signals
  struct Range {
    std::uint64_t first = 0, last = 0;
  };
  std::vector<Range> ranges;
};

// value = raw * factor + offset, in `unit`.
struct Signal {
  std::string name;
  int start_bit = 0;
  int length = 1;  // bits, 1..64
  ByteOrder order = ByteOrder::intel;
  NumberFormat format = NumberFormat::unsigned_integer;
  double factor = 1.0;
  double offset = 0.0;
  double minimum = 0.0, maximum = 0.0;  // both 0: not stated
  std::string unit;                     // UTF-8
  bool multiplexor = false;
  std::optional<Multiplexing> multiplexed;
};

// Number of bytes that a frame needs to contain this signal.
std::size_t bytes_needed(const Signal& signal);

// The raw bits, right-aligned, not sign-extended. Empty if the frame is too short.
std::optional<std::uint64_t> raw_bits(const Signal& signal, std::span<const std::uint8_t> data);

// Decodes the value. Empty if the frame is too short. A float signal may give NaN or infinity.
// Integers of more than 53 bits are rounded to the nearest double.
std::optional<double> decode(const Signal& signal, std::span<const std::uint8_t> data);

// True if the value lies in the signal's stated range (half a step of tolerance), or if none is
// stated.
bool in_range(const Signal& signal, double value);

// Rounds to the nearest raw value and changes the bits of this signal only. An Error names the
// signal, the value and the range that fits.
Result<void> encode(const Signal& signal, double value, std::span<std::uint8_t> data);

}  // namespace shaker::protocol::can
