#include "protocol/can/dbc_reader.hpp"

#include <charconv>

#include <fmt/format.h>

#include "protocol/can/frame.hpp"

namespace shaker::protocol::can {
namespace {

using Kind = DbcToken::Kind;

constexpr std::uint64_t kExtendedBit = 0x80000000;
constexpr std::uint64_t kPseudoMessage = 0xC0000000;  // VECTOR__INDEPENDENT_SIG_MSG: no frame
constexpr std::uint64_t kLargestMessage = 1785;       // bytes; a J1939 transport, more than a frame

bool parse_whole(std::string_view text, std::uint64_t& value) {
  const char* last = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), last, value);
  return parsed.ptr == last && parsed.ec == std::errc{};
}

}  // namespace

std::string DbcReader::found() const {
  if (token_.kind == Kind::end) return "the end of the file";
  if (token_.kind == Kind::text) return "a quoted text";
  return fmt::format("'{}'", token_.text.substr(0, 40));
}

void DbcReader::expected(const std::string& what) const {
  throw DbcSyntaxError{token_.line, fmt::format("found {}, expected {}", found(), what)};
}

DbcToken DbcReader::take() {
  const DbcToken taken = token_;
  if (taken.unterminated) {
    throw DbcSyntaxError{taken.line, "found a quoted text without an end, expected a closing '\"'"};
  }
  token_ = lexer_.next();
  return taken;
}

void DbcReader::mark(char c, const char* where) {
  if (!at_mark(c)) expected(fmt::format("'{}' {}", c, where));
  take();
}

std::string DbcReader::word(const char* what) {
  if (token_.kind != Kind::word) expected(what);
  return std::string(take().text);
}

std::uint64_t DbcReader::whole(const char* what) {
  std::uint64_t value = 0;
  if (token_.kind != Kind::number || !parse_whole(token_.text, value)) {
    expected(fmt::format("{} (a whole number)", what));
  }
  take();
  return value;
}

double DbcReader::number(const char* what) {
  std::string_view text = token_.text;
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const char* last = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), last, value);
  if (token_.kind != Kind::number || parsed.ptr != last || parsed.ec != std::errc{}) {
    expected(fmt::format("{} (a number)", what));
  }
  take();
  return value;
}

void DbcReader::read_section() {
  if (at_mark(';')) {
    take();
    return;
  }
  if (token_.kind != Kind::word) expected("a section such as BO_, VAL_ or CM_");
  if (token_.text == "BO_") return read_message();
  if (token_.text == "SG_") expected("BO_ before the first SG_");
  if (token_.text == "SIG_VALTYPE_") return read_value_type();
  if (token_.text == "SG_MUL_VAL_") return read_multiplexed_by();
  if (token_.text == "BA_") return read_attribute();
  if (token_.text == "BA_DEF_DEF_") return read_attribute_default();
  if (token_.text == "NS_") return skip_new_symbols();
  skip_section();
}

// NS_ lists names of sections, one on each line; none of them begins a section.
void DbcReader::skip_new_symbols() {
  const int line = take().line;
  while (token_.kind != Kind::end && token_.line == line)
    take();
  while (token_.kind == Kind::word) {
    const DbcToken after = DbcLexer(lexer_).next();
    if (after.kind != Kind::end && !after.first_on_line) return;
    take();
  }
}

// Skips to ';' or to a line that opens another section (not every section has a ';').
void DbcReader::skip_section() {
  take();
  while (token_.kind != Kind::end) {
    if (at_mark(';')) {
      take();
      return;
    }
    if (token_.first_on_line && token_.kind == Kind::word && token_.text.ends_with('_')) return;
    take();
  }
}

void DbcReader::read_message() {
  MessageSource source{take().line, {}};
  Message message;
  const std::uint64_t id = whole("the message's identifier after BO_");
  message.name = word("the message's name");
  mark(':', "after the message's name");
  const std::uint64_t size = whole("the message's length in bytes");
  if (token_.kind == Kind::word && !token_.first_on_line) take();  // transmitter

  const bool pseudo = id == kPseudoMessage;
  if (!pseudo) check_message(message, id, size, source.line);
  while (token_.kind == Kind::word && token_.text == "SG_") {
    read_signal(pseudo ? nullptr : &message, &source);
  }
  if (pseudo) return;
  by_id.emplace(id, messages.size());
  messages.push_back(std::move(message));
  sources.push_back(std::move(source));
}

void DbcReader::check_message(Message& message, std::uint64_t id, std::uint64_t size, int line) {
  message.extended = (id & kExtendedBit) != 0;
  const std::uint64_t plain = id & ~kExtendedBit;
  if (plain > (message.extended ? kExtendedMask : kStandardMask)) {
    throw DbcSyntaxError{
        line, fmt::format("found identifier {} of message {}, expected at most 2047, or bit "
                          "31 set and at most 29 bits below it",
                          id, message.name)};
  }
  if (size > kLargestMessage) {
    throw DbcSyntaxError{line, fmt::format("found length {} of message {}, expected 0 to {} bytes",
                                           size, message.name, kLargestMessage)};
  }
  message.id = static_cast<std::uint32_t>(plain);
  message.size = static_cast<std::size_t>(size);
  if (const auto it = by_id.find(id); it != by_id.end()) {
    throw DbcSyntaxError{
        line, fmt::format("found message {} with identifier {}, which message {} on line {} "
                          "has already; expected each identifier once",
                          message.name, id, messages[it->second].name, sources[it->second].line)};
  }
  const auto [it, is_new] = line_of_name.emplace(message.name, line);
  if (!is_new) {
    throw DbcSyntaxError{
        line, fmt::format("found a second message {} (the first is on line {}), expected "
                          "each name once",
                          message.name, it->second)};
  }
}

// Precondition: at SG_. Without a message the signal is read and discarded.
void DbcReader::read_signal(Message* message, MessageSource* source) {
  SignalSource from{take().line, std::nullopt};
  Signal signal;
  signal.name = word("the signal's name after SG_");
  if (token_.kind == Kind::word) read_multiplexor_mark(signal, from);
  mark(':', "before the signal's bits");
  read_bits(signal, from.line, message);
  read_scaling(signal);
  skip_receivers();
  if (message == nullptr) return;
  if (message->find(signal.name) != nullptr) {
    throw DbcSyntaxError{from.line,
                         fmt::format("found a second signal {} in message {}, expected each once",
                                     signal.name, message->name)};
  }
  message->signals.push_back(std::move(signal));
  source->signals.push_back(from);
}

// Reads M, m0, m1, ... or m0M.
void DbcReader::read_multiplexor_mark(Signal& signal, SignalSource& source) {
  std::string_view text = token_.text;
  if (text.ends_with('M')) {
    signal.multiplexor = true;
    text.remove_suffix(1);
  }
  if (!text.empty()) {
    std::uint64_t value = 0;
    if (text[0] != 'm' || !parse_whole(text.substr(1), value)) {
      expected("':' or a multiplexor mark M, m0, m1, ... m0M");
    }
    source.selected_by = value;
  }
  take();
}

void DbcReader::skip_receivers() {
  bool more = false;
  while (token_.kind != Kind::end && (more || !token_.first_on_line) && token_.text != "SG_") {
    more = at_mark(',');
    take();
  }
}

void DbcReader::read_bits(Signal& signal, int line, const Message* message) {
  const std::uint64_t start = whole("the start bit");
  mark('|', "between start bit and length");
  const std::uint64_t length = whole("the length in bits");
  mark('@', "before the byte order");
  const std::uint64_t order = whole("the byte order, 1 for Intel or 0 for Motorola");
  if (order > 1) {
    throw DbcSyntaxError{line,
                         fmt::format("found byte order {} of signal {}, expected 1 (Intel) or 0 "
                                     "(Motorola)",
                                     order, signal.name)};
  }
  if (!at_mark('+') && !at_mark('-')) expected("'+' (unsigned) or '-' (signed)");
  const bool is_signed = take().text == "-";
  if (length < 1 || length > 64) {
    throw DbcSyntaxError{
        line, fmt::format("found {} bits for signal {}, expected 1 to 64", length, signal.name)};
  }
  signal.length = static_cast<int>(length);
  signal.order = order == 1 ? ByteOrder::intel : ByteOrder::motorola;
  signal.format = is_signed ? NumberFormat::signed_integer : NumberFormat::unsigned_integer;
  const bool start_fits = start < kLargestMessage * 8;
  signal.start_bit = start_fits ? static_cast<int>(start) : 0;
  if (message != nullptr && (!start_fits || bytes_needed(signal) > message->size)) {
    throw DbcSyntaxError{
        line, fmt::format("found signal {} at {}|{}@{}, expected that it fits into the {} bytes "
                          "of message {}",
                          signal.name, start, length, order, message->size, message->name)};
  }
}

void DbcReader::read_scaling(Signal& signal) {
  mark('(', "before factor and offset");
  const int line = token_.line;
  signal.factor = number("the factor");
  mark(',', "between factor and offset");
  signal.offset = number("the offset");
  mark(')', "after factor and offset");
  if (signal.factor == 0.0) {
    throw DbcSyntaxError{
        line,
        fmt::format("found factor 0 of signal {}, expected a number that is not 0", signal.name)};
  }
  mark('[', "before minimum and maximum");
  signal.minimum = number("the minimum");
  mark('|', "between minimum and maximum");
  signal.maximum = number("the maximum");
  mark(']', "after minimum and maximum");
  if (token_.kind != Kind::text) expected("the unit in quotes");
  signal.unit = std::string(take().text);
}

void DbcReader::read_value_type() {
  ValueType type;
  type.line = take().line;
  type.id = whole("the message's identifier after SIG_VALTYPE_");
  type.signal = word("the signal's name");
  if (at_mark(':')) take();  // some tools omit it
  const int line = token_.line;
  const std::uint64_t code = whole("the value type");
  mark(';', "after SIG_VALTYPE_");
  if (code > 2) {
    throw DbcSyntaxError{line,
                         fmt::format("found value type {} of signal {}, expected 0 (integer), 1 "
                                     "(float32) or 2 (float64)",
                                     code, type.signal)};
  }
  type.format = code == 1 ? NumberFormat::float32 : NumberFormat::float64;
  if (code != 0) value_types.push_back(std::move(type));
}

// SG_MUL_VAL_ 100 signal multiplexor 1-3, 5-5;
void DbcReader::read_multiplexed_by() {
  MultiplexedBy by;
  by.line = take().line;
  by.id = whole("the message's identifier after SG_MUL_VAL_");
  by.signal = word("the signal's name");
  by.multiplexor = word("the multiplexor's name");
  do {
    if (at_mark(',')) take();
    Multiplexing::Range range;
    range.first = whole("the first value of a range");
    // "1-3" is lexed as the two numbers 1 and -3.
    if (at_mark('-')) {
      take();
    } else if (token_.kind == Kind::number && token_.text.starts_with('-')) {
      token_.text.remove_prefix(1);
    } else {
      expected("'-' and the last value of a range");
    }
    range.last = whole("the last value of a range");
    by.ranges.push_back(range);
  } while (at_mark(','));
  mark(';', "after SG_MUL_VAL_");
  multiplexed_by.push_back(std::move(by));
}

void DbcReader::read_attribute() {
  const int line = take().line;
  if (token_.kind != Kind::text || token_.text != "GenMsgCycleTime") return skip_section();
  take();
  if (token_.kind != Kind::word || token_.text != "BO_") return skip_section();
  take();
  CycleTime time;
  time.line = line;
  time.id = whole("the message's identifier");
  time.milliseconds = number("the cycle time in ms");
  mark(';', "after BA_");
  cycle_times.push_back(std::move(time));
}

void DbcReader::read_attribute_default() {
  take();
  if (token_.kind != Kind::text || token_.text != "GenMsgCycleTime") return skip_section();
  take();
  default_cycle_ms = number("the default cycle time in ms");
  mark(';', "after BA_DEF_DEF_");
}

}  // namespace shaker::protocol::can
