#include "cli/csv.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace shaker::cli {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t'; };
  while (!text.empty() && blank(text.front()))
    text.remove_prefix(1);
  while (!text.empty() && blank(text.back()))
    text.remove_suffix(1);
  return text;
}

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> fields;
  for (;;) {
    const auto comma = line.find(',');
    fields.push_back(trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

std::string shown(std::string_view text) {
  std::string out;
  for (const char c : text.substr(0, 40))
    out += static_cast<unsigned char>(c) >= 0x20 ? c : '?';
  return out + (text.size() > 40 ? "..." : "");
}

class Reader {
 public:
  Reader(std::istream& in, const std::string& origin) : in_(in), origin_(origin) {}

  // Returns false at the end of the file, or when error() is set.
  bool next_line() {
    line_.clear();
    for (int c = in_.get(); c != std::istream::traits_type::eof(); c = in_.get()) {
      if (c == '\n') return finish_line();
      if (line_.size() >= kMaxCsvLine) {
        ++number_;
        return fail(
            fmt::format("{}: longer than {} bytes; is this a CSV file?", place(), kMaxCsvLine));
      }
      line_.push_back(static_cast<char>(c));
    }
    if (in_.bad()) return fail(fmt::format("{}: reading failed", origin_));
    return !line_.empty() && finish_line();
  }

  bool fail(std::string sentence) {
    error_ = Error{ErrorKind::invalid, std::move(sentence)};
    return false;
  }

  std::string place() const { return fmt::format("{}:{}", origin_, number_); }
  const std::string& line() const { return line_; }
  const std::optional<Error>& error() const { return error_; }

 private:
  bool finish_line() {
    ++number_;
    if (number_ == 1 && line_.starts_with("\xEF\xBB\xBF")) line_.erase(0, 3);
    if (!line_.empty() && line_.back() == '\r') line_.pop_back();
    return true;
  }

  std::istream& in_;
  const std::string& origin_;
  std::string line_;
  std::size_t number_ = 0;
  std::optional<Error> error_;
};

// "displacement [mm]": the name, the unit, and both as they are written.
struct Header {
  std::string_view whole, name, unit;
};

Header header_of(std::string_view whole) {
  for (const std::string_view brackets : {"[]", "()"}) {
    const auto open = whole.find(brackets[0]);
    if (open == whole.npos || open == 0 || !whole.ends_with(brackets[1])) continue;
    return {whole, trimmed(whole.substr(0, open)),
            trimmed(whole.substr(open + 1, whole.size() - open - 2))};
  }
  return {whole, whole, {}};
}

std::vector<Header> headers_of(std::string_view line) {
  std::vector<Header> headers;
  for (const std::string_view whole : split(line))
    headers.push_back(header_of(whole));
  return headers;
}

struct Column {
  std::string name, unit;
  std::size_t index = 0;
};

// The wanted columns in a row.
Result<std::vector<Column>> find_columns(
    const Reader& reader, const std::vector<std::vector<std::string>>& alternatives) {
  const auto headers = headers_of(reader.line());
  for (const auto& wanted : alternatives) {
    std::vector<Column> found;
    for (const std::string& name : wanted) {
      const auto has_name = [&](const Header& h) { return h.whole == name || h.name == name; };
      const auto at = std::find_if(headers.begin(), headers.end(), has_name);
      if (at == headers.end()) break;
      if (std::find_if(at + 1, headers.end(), has_name) != headers.end()) {
        return Error{ErrorKind::invalid,
                     fmt::format("{}: column \"{}\" occurs twice", reader.place(), name)};
      }
      found.push_back(
          {name, std::string(at->unit), static_cast<std::size_t>(at - headers.begin())});
    }
    if (found.size() == wanted.size()) return found;
  }
  std::vector<std::string> lists;
  for (const auto& wanted : alternatives)
    lists.push_back(fmt::format("{}", fmt::join(wanted, ",")));
  return Error{ErrorKind::invalid,
               fmt::format("{}: the header row is \"{}\"; columns {} are wanted", reader.place(),
                           shown(reader.line()), fmt::join(lists, " or "))};
}

std::optional<std::string> parse_number(std::string_view text, double most, double& value) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size() || text.empty()) {
    return fmt::format("\"{}\" is not a number{}", shown(text),
                       text.find(';') != text.npos ? "; separate columns by commas" : "");
  }
  if (!std::isfinite(value)) return fmt::format("\"{}\" is not a finite number", shown(text));
  if (std::fabs(value) > most)
    return fmt::format("\"{}\" is larger than anything measured; at most {:g} is read", shown(text),
                       most);
  return std::nullopt;
}

}  // namespace

Result<CsvTable> read_csv(std::istream& in, const std::string& origin,
                          const std::vector<std::vector<std::string>>& alternatives, double most) {
  Reader reader(in, origin);
  if (!reader.next_line()) {
    if (reader.error()) return *reader.error();
    return Error{ErrorKind::invalid, fmt::format("{}: is empty; a header row is wanted", origin)};
  }
  const auto columns = find_columns(reader, alternatives);
  if (!columns) return columns.error();
  const std::size_t width = split(reader.line()).size();
  CsvTable table;
  std::vector<std::vector<double>*> into;
  for (const auto& [name, unit, at] : *columns) {
    into.push_back(&table.columns[name]);
    if (!unit.empty()) table.units[name] = unit;
  }
  while (reader.next_line()) {
    if (trimmed(reader.line()).empty()) continue;
    const auto fields = split(reader.line());
    if (fields.size() != width) {
      return Error{ErrorKind::invalid, fmt::format("{}: {} fields; the header has {}",
                                                   reader.place(), fields.size(), width)};
    }
    if (into.front()->size() == kMaxCsvRows) {
      return Error{ErrorKind::invalid, fmt::format("{}: more than {} rows; cut the file into runs",
                                                   reader.place(), kMaxCsvRows)};
    }
    for (std::size_t k = 0; k < into.size(); ++k) {
      const auto& [name, unit, at] = (*columns)[k];
      double value = 0.0;
      if (const auto trouble = parse_number(fields[at], most, value)) {
        return Error{ErrorKind::invalid,
                     fmt::format("{}:{}: {} ({})", reader.place(), at + 1, *trouble, name)};
      }
      into[k]->push_back(value);
    }
  }
  if (reader.error()) return *reader.error();
  return table;
}

Result<CsvTable> read_csv(const std::filesystem::path& file,
                          const std::vector<std::vector<std::string>>& alternatives, double most) {
  std::error_code code;
  if (std::filesystem::is_directory(file, code)) {
    return Error{ErrorKind::io, fmt::format("{}: is a directory, not a file", file.string())};
  }
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    return Error{ErrorKind::io,
                 fmt::format("{}: cannot be read: {}", file.string(), std::strerror(errno))};
  }
  return read_csv(in, file.string(), alternatives, most);
}

}  // namespace shaker::cli
