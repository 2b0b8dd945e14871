// Parses one line of a log written by `candump -l` (or -L), e.g.
//
//   (1436509052.249713) can0 181#2A366C2BBA00        classic, standard identifier
//   (1436509052.249713) can0 1F334455#1122           classic, extended: eight digits
//   (1436509052.249713) can0 123##1AABBCC            FD, one digit of flags
//   (1436509052.249713) can0 123#R8                  remote frame
//   (1436509052.249713) can0 20000040#0000000000000000   error frame: bit 29 set
//
// Pure, no allocation. Source: can-utils 2020.11, lib.c (the format that it writes).
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "protocol/can/frame.hpp"

namespace shaker::protocol::can {

struct LogEntry {
  std::int64_t t_ns = 0;       // as logged: since 1970 with -l, since the first frame with -t z
  std::string_view interface;  // points into the line
  Frame frame;
};

// Returns nothing if the line does not have one of these forms.
std::optional<LogEntry> parse_log_line(std::string_view line);

}  // namespace shaker::protocol::can
