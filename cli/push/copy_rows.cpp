#include "cli/push/copy_rows.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace shaker::cli {

std::string storable_text(std::string_view text) {
  const std::string escaped = nlohmann::json(std::string(text))
                                  .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  const auto valid = nlohmann::json::parse(escaped).get<std::string>();
  std::string storable;
  for (const char c : valid)
    c == '\0' ? storable.append("\xef\xbf\xbd") : storable.append(1, c);
  return storable;
}

CopyRows& CopyRows::field(std::string_view escaped) {
  if (within_row_) bytes_ += '\t';
  within_row_ = true;
  bytes_ += escaped;
  return *this;
}

CopyRows& CopyRows::text(std::string_view value) {
  std::string escaped;
  for (const char c : storable_text(value)) {
    switch (c) {
      case '\\':
        escaped += "\\\\";
        break;
      case '\t':
        escaped += "\\t";
        break;
      case '\n':
        escaped += "\\n";
        break;
      case '\r':
        escaped += "\\r";
        break;
      default:
        escaped += c;
    }
  }
  return field(escaped);
}

CopyRows& CopyRows::number(double value) {
  return field(fmt::format("{}", value));
}
CopyRows& CopyRows::number(std::optional<double> value) {
  return value ? number(*value) : null();
}
CopyRows& CopyRows::count(std::int64_t value) {
  return field(fmt::format("{}", value));
}
CopyRows& CopyRows::flag(bool value) {
  return field(value ? "t" : "f");
}
CopyRows& CopyRows::array(const std::vector<double>& values) {
  return field(fmt::format("{{{}}}", fmt::join(values, ",")));
}
CopyRows& CopyRows::null() {
  return field("\\N");
}

void CopyRows::end_row() {
  bytes_ += '\n';
  ++rows_;
  within_row_ = false;
}

}  // namespace shaker::cli
