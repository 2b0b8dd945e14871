// Any text as a DBC file: the result is a database with readable signals, or a sentence with a
// place.
#include <cstdlib>
#include <string_view>
#include <vector>

#include "protocol/can/database.hpp"
#include "tests/fuzz/target.hpp"

namespace can = shaker::protocol::can;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto parsed = can::parse_dbc({reinterpret_cast<const char*>(data), size}, "fuzz.dbc");
  if (!parsed) {
    if (!parsed.error().what.starts_with("fuzz.dbc:")) std::abort();
    return 0;
  }
  for (const can::Message& message : parsed->messages) {
    std::vector<std::uint8_t> full(message.size, 0xA5);
    for (const can::Signal& signal : message.signals) {
      // Every signal fits into its message, and none is read from a frame that is one byte too
      // short.
      if (can::decode(message, signal, full).presence == can::Presence::malformed) std::abort();
      const auto needed = can::bytes_needed(signal);
      if (can::raw_bits(signal, std::span(full).first(needed - 1))) std::abort();
      if (auto done = can::encode(signal, signal.offset, full); !done) continue;
      can::decode(message, signal, full);
    }
  }
  return 0;
}
