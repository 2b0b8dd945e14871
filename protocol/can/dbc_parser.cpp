// The DBC format has no published standard; this parser follows the files of the common tools.
// It uses two passes: it first reads the sections in order and then connects them, because a
// multiplexor may come after its signals, and value types are at the end of the file.
#include <fmt/format.h>

#include "protocol/can/database.hpp"
#include "protocol/can/dbc_lexer.hpp"
#include "protocol/can/dbc_reader.hpp"

namespace shaker::protocol::can {
namespace {

struct Place {
  Message* message;
  MessageSource* source;
  std::size_t signal;
};

Place find_signal(DbcReader& in, const About& about, const std::string& name, const char* section) {
  const auto it = in.by_id.find(about.id);
  if (it == in.by_id.end()) {
    throw DbcSyntaxError{about.line,
                         fmt::format("found message {} in {}, expected one that a BO_ line names",
                                     about.id, section)};
  }
  Message& message = in.messages[it->second];
  const Signal* signal = message.find(name);
  if (signal == nullptr) {
    throw DbcSyntaxError{
        about.line, fmt::format("found signal {} in {}, expected one of message {}", name, section,
                                message.name)};
  }
  return {&message, &in.sources[it->second],
          static_cast<std::size_t>(signal - message.signals.data())};
}

void join_value_types(DbcReader& in) {
  for (const ValueType& type : in.value_types) {
    const Place place = find_signal(in, type, type.signal, "SIG_VALTYPE_");
    Signal& signal = place.message->signals[place.signal];
    const int bits = type.format == NumberFormat::float32 ? 32 : 64;
    if (signal.length != bits) {
      throw DbcSyntaxError{
          type.line, fmt::format("found float{} for signal {} of {} bits, expected {} bits", bits,
                                 signal.name, signal.length, bits)};
    }
    signal.format = type.format;
  }
}

void join_extended_multiplexing(DbcReader& in) {
  for (MultiplexedBy& by : in.multiplexed_by) {
    const Place selector = find_signal(in, by, by.multiplexor, "SG_MUL_VAL_");
    const Place place = find_signal(in, by, by.signal, "SG_MUL_VAL_");
    if (!selector.message->signals[selector.signal].multiplexor) {
      throw DbcSyntaxError{by.line,
                           fmt::format("found {} as multiplexor of {}, expected a signal marked M",
                                       by.multiplexor, by.signal)};
    }
    auto& joined = place.message->signals[place.signal].multiplexed.emplace();
    joined.multiplexor = static_cast<int>(selector.signal);
    joined.ranges = std::move(by.ranges);
  }
}

void join_plain_multiplexing(Message& message, const MessageSource& source) {
  std::vector<int> multiplexors;
  for (std::size_t i = 0; i < message.signals.size(); ++i) {
    if (message.signals[i].multiplexor) multiplexors.push_back(static_cast<int>(i));
  }
  for (std::size_t i = 0; i < message.signals.size(); ++i) {
    Signal& signal = message.signals[i];
    const auto& from = source.signals[i];
    if (!from.selected_by || signal.multiplexed) continue;
    if (multiplexors.size() != 1 || multiplexors[0] == static_cast<int>(i)) {
      throw DbcSyntaxError{
          from.line,
          fmt::format(
              "found multiplexed signal {} in message {} with {} multiplexors, expected one signal "
              "marked M, or SG_MUL_VAL_ to say which of them",
              signal.name, message.name, multiplexors.size())};
    }
    signal.multiplexed = Multiplexing{multiplexors[0], {{*from.selected_by, *from.selected_by}}};
  }
}

void check_multiplexing(const Message& message, const MessageSource& source) {
  for (std::size_t i = 0; i < message.signals.size(); ++i) {
    const Signal* s = &message.signals[i];
    for (std::size_t steps = 0; s->multiplexed; ++steps) {
      s = &message.signals[static_cast<std::size_t>(s->multiplexed->multiplexor)];
      if (steps > message.signals.size()) {
        throw DbcSyntaxError{
            source.signals[i].line,
            fmt::format("found that signal {} selects itself in a circle, expected a "
                        "multiplexor that stands in every frame",
                        message.signals[i].name)};
      }
    }
  }
}

void join_cycle_times(DbcReader& in) {
  if (in.default_cycle_ms > 0.0) {
    for (Message& message : in.messages)
      message.cycle_time_s = in.default_cycle_ms * 1e-3;
  }
  for (const CycleTime& time : in.cycle_times) {
    const auto it = in.by_id.find(time.id);
    if (it == in.by_id.end()) continue;  // a pseudo-message without a frame
    auto& cycle = in.messages[it->second].cycle_time_s;
    cycle = time.milliseconds > 0.0 ? std::optional(time.milliseconds * 1e-3) : std::nullopt;
  }
}

}  // namespace

Result<Database> parse_dbc(std::string_view text, const std::string& origin) {
  const std::string utf8 = to_utf8(text);
  DbcReader in(utf8);
  try {
    in.read_all();
    join_value_types(in);
    join_extended_multiplexing(in);
    for (std::size_t i = 0; i < in.messages.size(); ++i) {
      join_plain_multiplexing(in.messages[i], in.sources[i]);
      check_multiplexing(in.messages[i], in.sources[i]);
    }
    join_cycle_times(in);
  } catch (const DbcSyntaxError& error) {
    return Error{ErrorKind::invalid, fmt::format("{}:{}: {}", origin, error.line, error.what)};
  }
  if (in.messages.empty()) {
    return Error{
        ErrorKind::invalid,
        fmt::format("{}: found no message, expected at least one BO_ section; is this a DBC file?",
                    origin)};
  }
  return Database{origin, std::move(in.messages)};
}

}  // namespace shaker::protocol::can
