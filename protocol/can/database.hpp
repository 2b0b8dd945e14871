// The contents of a DBC file: the messages of a bus and their signals.
//
// parse_dbc builds it once at start-up; afterwards it is constant and thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "protocol/can/signal.hpp"

namespace shaker::protocol::can {

struct Message {
  std::string name;
  std::uint32_t id = 0;
  bool extended = false;  // 29-bit identifier
  std::size_t size = 0;   // bytes, 0..64; a real frame may be shorter (see decode)
  std::vector<Signal> signals;
  std::optional<double> cycle_time_s;  // GenMsgCycleTime: the expected period

  const Signal* find(std::string_view signal) const;
};

struct Database {
  std::string origin;  // file, for messages
  std::vector<Message> messages;

  const Message* find(std::string_view message) const;
  const Message* find(std::uint32_t id, bool extended) const;
};

enum class Presence : std::uint8_t {
  present,
  not_selected,  // another multiplexed signal is in this frame
  malformed      // the frame is too short for it, or for its multiplexor
};
struct Decoded {
  Presence presence = Presence::malformed;
  double value = 0.0;  // if present
};

// Decodes one signal of a frame, after its multiplexors. `signal` is one of `message`'s.
Decoded decode(const Message& message, const Signal& signal, std::span<const std::uint8_t> data);

// Parses the text of a DBC file, UTF-8 or Latin-1, with any line ends. Reads BO_, SG_,
// SIG_VALTYPE_, SG_MUL_VAL_ and the attribute GenMsgCycleTime; skips every other section. An
// Error has the form "FILE:LINE: found ..., expected ...". `origin` names the file.
Result<Database> parse_dbc(std::string_view text, const std::string& origin);

}  // namespace shaker::protocol::can
