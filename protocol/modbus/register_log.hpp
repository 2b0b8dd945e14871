// One line of a log of Modbus polls, the counterpart of `candump -l` for CAN, e.g.
//
//   (12.345678901 12.346998210) input6#3E22D0E54120 holding10#0001    a poll: asked, received
//   (12.345678901 12.346998210) error                                 a poll without an answer
//   (12.340000000 12.340000000) connected                             a new connection
//
// Times are s of CLOCK_MONOTONIC. A block consists of table, address, '#' and its raw
// registers, four hexadecimal digits each. Pure; parsing does not allocate.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "protocol/modbus/block.hpp"

namespace shaker::protocol::modbus {

struct RegisterLogLine {
  enum class Kind { poll, error, connected };
  std::int64_t asked_ns = 0, received_ns = 0;
  Kind kind = Kind::poll;
  std::string_view blocks;  // of a poll; points into the line
};

// Returns nothing if the line does not have one of these forms.
std::optional<RegisterLogLine> parse_register_line(std::string_view line);

// Removes the first block from `blocks` if it is complete and the required one, and writes its
// registers to `words` (block.words of them). Returns false otherwise.
bool take_block(std::string_view& blocks, const Block& wanted, std::span<std::uint16_t> words);

// These append to the line, without the newline.
void begin_register_line(std::string& line, std::int64_t asked_ns, std::int64_t received_ns);
void add_block(std::string& line, const Block& block, std::span<const std::uint16_t> words);

}  // namespace shaker::protocol::modbus
