// One line of a log of Modbus polls, beside what `candump -l` is for CAN, e.g.
//
//   (12.345678901 12.346998210) input6#3E22D0E54120 holding10#0001    a poll: asked, received
//   (12.345678901 12.346998210) error                                 a poll without an answer
//   (12.340000000 12.340000000) connected                             a new connection
//
// Times are s of CLOCK_MONOTONIC; a block is table, address, '#' and its registers as they came,
// four hexadecimal digits each. Pure; parsing allocates nothing.
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

// Nothing when the line is not one of these.
std::optional<RegisterLogLine> parse_register_line(std::string_view line);

// Takes the first block off `blocks` when it is the wanted one and is whole; its registers go into
// `words` (block.words of them). False otherwise.
bool take_block(std::string_view& blocks, const Block& wanted, std::span<std::uint16_t> words);

// Appends, without the newline.
void begin_register_line(std::string& line, std::int64_t asked_ns, std::int64_t received_ns);
void add_block(std::string& line, const Block& block, std::span<const std::uint16_t> words);

}  // namespace shaker::protocol::modbus
