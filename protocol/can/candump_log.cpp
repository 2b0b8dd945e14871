#include "protocol/can/candump_log.hpp"

#include <algorithm>
#include <charconv>

namespace shaker::protocol::can {
namespace {

constexpr std::uint32_t kErrorBit = 0x20000000;
constexpr std::uint64_t kMaxSeconds = 9'000'000'000;  // keeps nanoseconds inside 64 bits

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

// Removes and returns the next word.
std::string_view next_word(std::string_view& text) {
  text = trimmed(text);
  const auto end = std::min(text.find_first_of(" \t"), text.size());
  const auto word = text.substr(0, end);
  text.remove_prefix(end);
  return word;
}

bool parse_decimal(std::string_view text, std::uint64_t& value) {
  const char* last = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), last, value);
  return !text.empty() && parsed.ptr == last && parsed.ec == std::errc{};
}

// "(seconds.fraction)", with up to nine digits of fraction.
std::optional<std::int64_t> parse_time(std::string_view text) {
  if (text.size() < 3 || text.front() != '(' || text.back() != ')') return std::nullopt;
  text = text.substr(1, text.size() - 2);
  const auto dot = text.find('.');
  if (dot == std::string_view::npos) return std::nullopt;
  const auto digits = text.substr(dot + 1);
  std::uint64_t whole = 0, fraction = 0;
  if (!parse_decimal(text.substr(0, dot), whole) || whole > kMaxSeconds) return std::nullopt;
  if (digits.size() > 9 || !parse_decimal(digits, fraction)) return std::nullopt;
  for (std::size_t i = digits.size(); i < 9; ++i)
    fraction *= 10;
  return static_cast<std::int64_t>(whole * 1'000'000'000 + fraction);
}

bool parse_id(std::string_view text, Frame& frame) {
  if (text.size() != 3 && text.size() != 8) return false;
  std::uint32_t id = 0;
  for (const char c : text) {
    const int digit = hex_digit(c);
    if (digit < 0) return false;
    id = id << 4 | static_cast<std::uint32_t>(digit);
  }
  if (text.size() == 3) {
    frame.id = id;
    return id <= kStandardMask;
  }
  frame.error = (id & kErrorBit) != 0;
  frame.extended = !frame.error;
  frame.id = id & kExtendedMask;
  return (id & ~(kErrorBit | kExtendedMask)) == 0;
}

bool parse_data(std::string_view text, std::size_t most, Frame& frame) {
  if (text.size() % 2 != 0 || text.size() / 2 > most) return false;
  for (std::size_t i = 0; i < text.size(); i += 2) {
    const int high = hex_digit(text[i]), low = hex_digit(text[i + 1]);
    if (high < 0 || low < 0) return false;
    frame.data[i / 2] = static_cast<std::uint8_t>(high << 4 | low);
  }
  frame.length = static_cast<std::uint8_t>(text.size() / 2);
  return true;
}

// Parses the text after the first '#'.
bool parse_body(std::string_view text, Frame& frame) {
  if (text.starts_with('#')) {  // FD: "##", flags, data
    frame.fd = true;
    if (text.size() < 2 || hex_digit(text[1]) < 0) return false;
    return parse_data(text.substr(2), kMaxLength, frame);
  }
  if (text.starts_with('R')) {
    frame.remote = true;
    text.remove_prefix(1);
    if (text.empty()) return true;
    if (text.size() != 1 || text[0] < '0' || text[0] > '8') return false;
    frame.length = static_cast<std::uint8_t>(text[0] - '0');
    return true;
  }
  // "_9" to "_F" after eight bytes is the raw length code of the wire; the data are complete.
  if (const auto raw = text.find('_'); raw != std::string_view::npos) {
    if (text.size() != raw + 2 || hex_digit(text[raw + 1]) < 0) return false;
    text = text.substr(0, raw);
  }
  return parse_data(text, kMaxClassicLength, frame);
}

}  // namespace

std::optional<LogEntry> parse_log_line(std::string_view line) {
  LogEntry entry;
  const auto time = parse_time(next_word(line));
  entry.interface = next_word(line);
  const auto text = next_word(line);
  const auto hash = text.find('#');
  const auto rest = trimmed(line);  // newer candump adds the direction
  if (!time || entry.interface.empty() || hash == std::string_view::npos) return std::nullopt;
  if (!rest.empty() && rest != "R" && rest != "T") return std::nullopt;
  if (!parse_id(text.substr(0, hash), entry.frame)) return std::nullopt;
  if (!parse_body(text.substr(hash + 1), entry.frame)) return std::nullopt;
  entry.t_ns = *time;
  return entry;
}

}  // namespace shaker::protocol::can
