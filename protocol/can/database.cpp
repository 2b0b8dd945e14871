#include "protocol/can/database.hpp"

#include <algorithm>

namespace shaker::protocol::can {

const Signal* Message::find(std::string_view signal) const {
  const auto it = std::ranges::find(signals, signal, &Signal::name);
  return it == signals.end() ? nullptr : &*it;
}

const Message* Database::find(std::string_view message) const {
  const auto it = std::ranges::find(messages, message, &Message::name);
  return it == messages.end() ? nullptr : &*it;
}

const Message* Database::find(std::uint32_t id, bool extended) const {
  const auto it = std::ranges::find_if(
      messages, [&](const Message& m) { return m.id == id && m.extended == extended; });
  return it == messages.end() ? nullptr : &*it;
}

Decoded decode(const Message& message, const Signal& signal, std::span<const std::uint8_t> data) {
  // parse_dbc refuses circular chains, so this loop ends.
  for (const Signal* s = &signal; s->multiplexed;) {
    const Signal& selector = message.signals[static_cast<std::size_t>(s->multiplexed->multiplexor)];
    const auto selected = raw_bits(selector, data);
    if (!selected) return {Presence::malformed, 0.0};
    const bool here = std::ranges::any_of(s->multiplexed->ranges, [&](const auto& range) {
      return *selected >= range.first && *selected <= range.last;
    });
    if (!here) return {Presence::not_selected, 0.0};
    s = &selector;
  }
  const auto value = decode(signal, data);
  if (!value) return {Presence::malformed, 0.0};
  return {Presence::present, *value};
}

}  // namespace shaker::protocol::can
