#include "protocol/modbus/register_log.hpp"

#include <charconv>
#include <iterator>

#include <fmt/format.h>

namespace shaker::protocol::modbus {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

std::string_view name(RegisterTable table) {
  return table == RegisterTable::input ? "input" : "holding";
}

bool take(std::string_view& text, std::string_view wanted) {
  if (!text.starts_with(wanted)) return false;
  text.remove_prefix(wanted.size());
  return true;
}

template <class Number>
bool take_number(std::string_view& text, Number& value, int base = 10) {
  const auto [end, trouble] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (trouble != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

// "12.345678901": whole seconds and nine digits.
bool take_time(std::string_view& text, std::int64_t& t_ns) {
  std::int64_t whole = 0, part = 0;
  if (!take_number(text, whole) || whole < 0 || whole > 4'000'000'000) return false;
  if (!take(text, ".") || text.size() < 9) return false;
  std::string_view digits = text.substr(0, 9);
  if (digits.front() == '-' || !take_number(digits, part) || !digits.empty()) return false;
  text.remove_prefix(9);
  t_ns = whole * kSecond + part;
  return true;
}

}  // namespace

std::optional<RegisterLogLine> parse_register_line(std::string_view line) {
  while (!line.empty() && (line.back() == '\r' || line.back() == ' '))
    line.remove_suffix(1);
  RegisterLogLine found;
  if (!take(line, "(") || !take_time(line, found.asked_ns) || !take(line, " ") ||
      !take_time(line, found.received_ns) || !take(line, ") ") ||
      found.received_ns < found.asked_ns) {
    return std::nullopt;
  }
  if (line == "connected") {
    found.kind = RegisterLogLine::Kind::connected;
  } else if (line == "error") {
    found.kind = RegisterLogLine::Kind::error;
  } else {
    found.blocks = line;
  }
  return found;
}

bool take_block(std::string_view& blocks, const Block& wanted, std::span<std::uint16_t> words) {
  std::string_view rest = blocks;
  int address = -1;
  if (!take(rest, name(wanted.table)) || !take_number(rest, address) || !take(rest, "#")) {
    return false;
  }
  const auto digits = 4 * static_cast<std::size_t>(wanted.words);
  if (address != wanted.address || rest.size() < digits) return false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(wanted.words); ++i) {
    std::string_view word = rest.substr(4 * i, 4);
    if (!take_number(word, words[i], 16) || !word.empty()) return false;
  }
  rest.remove_prefix(digits);
  if (!rest.empty() && !take(rest, " ")) return false;
  blocks = rest;
  return true;
}

void begin_register_line(std::string& line, std::int64_t asked_ns, std::int64_t received_ns) {
  fmt::format_to(std::back_inserter(line), "({}.{:09} {}.{:09})", asked_ns / kSecond,
                 asked_ns % kSecond, received_ns / kSecond, received_ns % kSecond);
}

void add_block(std::string& line, const Block& block, std::span<const std::uint16_t> words) {
  fmt::format_to(std::back_inserter(line), " {}{}#", name(block.table), block.address);
  for (const std::uint16_t word : words)
    fmt::format_to(std::back_inserter(line), "{:04X}", word);
}

}  // namespace shaker::protocol::modbus
