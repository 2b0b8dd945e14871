#include "base/shard.hpp"

#include <charconv>
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

}  // namespace shaker
