#include "base/shard.hpp"

#include <charconv>
#include <fstream>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>

namespace shaker {
namespace {

bool whole_number(std::string_view text, std::size_t& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() && number > 0;
}

}  // namespace

Shard shard_from(const std::string& text) {
  Shard shard;
  const auto slash = text.find('/');
  if (slash == std::string::npos ||
      !whole_number(std::string_view(text).substr(0, slash), shard.index) ||
      !whole_number(std::string_view(text).substr(slash + 1), shard.count) ||
      shard.index > shard.count)
    throw std::invalid_argument(
        fmt::format("\"{}\" is no part of a whole; write 3/7 for the third of seven", text));
  return shard;
}

void each_kept_line(const std::vector<std::filesystem::path>& files, const TakeLine& take) {
  for (const auto& file : files) {
    std::ifstream in(file);
    if (!in) throw std::runtime_error(fmt::format("{}: cannot be read", file.string()));
    std::string text;
    for (int number = 1; std::getline(in, text); ++number)
      take(text, number, fmt::format("{}, line {}", file.string(), number));
  }
}

}  // namespace shaker
