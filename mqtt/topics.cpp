#include "mqtt/topics.hpp"

#include <fmt/format.h>

namespace shaker::mqtt {
namespace {

bool stays(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
         c == '_' || c == '-' || byte >= 0x80;
}

// Control characters of Latin-1, which brokers refuse: U+0080 to U+009F.
bool is_late_control(std::string_view text, std::size_t at) {
  return text[at] == '\xC2' && at + 1 < text.size() &&
         static_cast<unsigned char>(text[at + 1]) < 0xA0;
}

}  // namespace

std::string topic_level(std::string_view name) {
  std::string level;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (is_late_control(name, i)) {
      level += '_';
      ++i;
    } else {
      level += stays(name[i]) ? name[i] : '_';
    }
  }
  return level.empty() ? "rig" : level;
}

Result<void> check_prefix(std::string_view prefix) {
  std::size_t begin = 0;
  while (true) {
    const std::size_t end = std::min(prefix.find('/', begin), prefix.size());
    const std::string_view level = prefix.substr(begin, end - begin);
    if (level.empty() || topic_level(level) != level) {
      return Error{ErrorKind::invalid,
                   fmt::format("\"{}\" is no prefix for topics: its levels are of letters, "
                               "digits, '.', '_' and '-', with one '/' between them",
                               prefix)};
    }
    if (end == prefix.size()) return {};
    begin = end + 1;
  }
}

}  // namespace shaker::mqtt
