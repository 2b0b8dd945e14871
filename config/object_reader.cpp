#include "config/object_reader.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace shaker::config {
namespace {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// JSON pointer escapes, RFC 6901.
std::string escaped(const std::string& key) {
  std::string out;
  for (const char c : key.substr(0, 80))
    out += c == '~' ? "~0" : c == '/' ? "~1" : std::string(1, c);
  return out;
}

}  // namespace

void Findings::add(const Node& at, const std::string& pointer, const std::string& sentence) {
  if (closed_) return;
  if (lines_.size() == kFindingsMax) {
    ++left_out_;
    return;
  }
  lines_.push_back(fmt::format("{}:{}: {}{}{}", origin_, at.line, pointer,
                               pointer.empty() ? "" : ": ", sentence));
}

Error Findings::error() const {
  std::string text = fmt::format("{}", fmt::join(lines_, "\n"));
  if (left_out_ > 0) text += fmt::format("\n{}: and {} more", origin_, left_out_);
  return Error{ErrorKind::invalid, text};
}

bool Range::holds(double value) const {
  return std::isfinite(value) && (low_open ? value > low : value >= low) &&
         (high_open ? value < high : value <= high);
}

std::string Range::text() const {
  const bool has_low = std::isfinite(low), has_high = std::isfinite(high);
  if (!has_low && !has_high) return "a finite number";
  const std::string from =
      has_low ? fmt::format("{} {}", low_open ? "above" : "at least", low) : "";
  const std::string to =
      has_high ? fmt::format("{} {}", high_open ? "below" : "at most", high) : "";
  return from + (has_low && has_high ? " and " : "") + to;
}

std::string suggestion(const std::string& wrong, std::span<const std::string> allowed) {
  if (allowed.empty()) return "no other key is allowed here";
  const std::string given = lower_case(wrong.substr(0, 80));
  std::size_t best = std::max<std::size_t>(2, given.size() / 3) + 1;
  const std::string* nearest = nullptr;
  for (const std::string& name : allowed) {
    // A shortened or lengthened name (timeout for timeout_s) is as near as a misspelt one.
    const bool part = given.size() >= 4 && (name.find(given) != std::string::npos ||
                                            given.find(name) != std::string::npos);
    const std::size_t distance = part ? 1 : edit_distance(given, lower_case(name));
    if (distance < best) {
      best = distance;
      nearest = &name;
    }
  }
  if (nearest) return fmt::format("did you mean \"{}\"?", *nearest);
  return fmt::format("allowed are {}", fmt::join(allowed, ", "));
}

ObjectReader::ObjectReader(const Node& node, std::string pointer, Findings& findings)
    : node_(node),
      pointer_(std::move(pointer)),
      findings_(findings),
      is_object_(node.kind == Node::Kind::object) {
  if (!is_object_) {
    findings_.add(node_, pointer_, fmt::format("is {}; an object {{...}} is wanted", node.shown()));
  }
}

std::string ObjectReader::at(const std::string& key) const {
  return pointer_ + "/" + escaped(key);
}

const Node* ObjectReader::member(const std::string& key, bool required) {
  known_.push_back(key);
  const Node* found = node_.find(key);
  if (!found && required && is_object_) {
    findings_.add(node_, pointer_, fmt::format("key \"{}\" is missing", key));
  }
  return found;
}

void ObjectReader::complain(const std::string& key, const std::string& sentence) {
  const Node* found = node_.find(key);
  findings_.add(found ? *found : node_, at(key), sentence);
}

void ObjectReader::read_number(const std::string& key, const Node& value, double& field,
                               Range range) {
  if (value.kind != Node::Kind::integer && value.kind != Node::Kind::number) {
    complain(key, fmt::format("{} is not a number; {} is allowed", value.shown(), range.text()));
  } else if (!range.holds(value.number)) {
    complain(key, fmt::format("{} is out of range; {} is allowed", value.shown(), range.text()));
  } else {
    field = value.number;
  }
}

bool ObjectReader::read_integer(const std::string& key, const Node& value, double& field,
                                Range range) {
  if (value.kind != Node::Kind::integer) {
    complain(key,
             fmt::format("{} is not a whole number; {} is allowed", value.shown(), range.text()));
    return false;
  }
  if (!range.holds(value.number)) {
    complain(key, fmt::format("{} is out of range; {} is allowed", value.shown(), range.text()));
    return false;
  }
  field = value.number;
  return true;
}

bool ObjectReader::read_string(const std::string& key, const Node& value, std::string& field,
                               bool empty_ok) {
  if (value.kind != Node::Kind::string) {
    complain(key, fmt::format("{} is not a string; write it in double quotes", value.shown()));
    return false;
  }
  if (value.text.empty() && !empty_ok) {
    complain(key, "is empty; a name is wanted");
    return false;
  }
  if (value.text.find('\0') != std::string::npos || value.text.size() > 4096) {
    complain(key, "holds a zero character or more than 4096 bytes");
    return false;
  }
  field = value.text;
  return true;
}

void ObjectReader::optional(const std::string& key, double& field, Range range) {
  if (const Node* value = member(key, false)) read_number(key, *value, field, range);
}
void ObjectReader::required(const std::string& key, double& field, Range range) {
  if (const Node* value = member(key, true)) read_number(key, *value, field, range);
}
void ObjectReader::optional(const std::string& key, std::optional<double>& field, Range range) {
  if (const Node* value = member(key, false)) {
    double number = std::numeric_limits<double>::quiet_NaN();
    read_number(key, *value, number, range);
    if (std::isfinite(number)) field = number;
  }
}
void ObjectReader::optional(const std::string& key, int& field, Range range) {
  double number = 0.0;
  if (const Node* value = member(key, false); value && read_integer(key, *value, number, range)) {
    field = static_cast<int>(number);
  }
}
void ObjectReader::required(const std::string& key, int& field, Range range) {
  if (member(key, true)) optional(key, field, range);
}
void ObjectReader::optional(const std::string& key, std::uint32_t& field) {
  double number = 0.0;
  const Node* value = member(key, false);
  if (value && read_integer(key, *value, number, at_least(0).at_most(4294967295.0))) {
    field = static_cast<std::uint32_t>(number);
  }
}
void ObjectReader::optional(const std::string& key, std::uint64_t& field) {
  // Above 2^53 a JSON number is not exact in every program that reads the file.
  double number = 0.0;
  const Node* value = member(key, false);
  if (value && read_integer(key, *value, number, at_least(0).at_most(9007199254740992.0))) {
    field = static_cast<std::uint64_t>(number);
  }
}
void ObjectReader::optional(const std::string& key, bool& field) {
  const Node* value = member(key, false);
  if (!value) return;
  if (value->kind != Node::Kind::boolean) {
    complain(key, fmt::format("{} is neither true nor false", value->shown()));
  } else {
    field = value->boolean;
  }
}
void ObjectReader::optional(const std::string& key, std::string& field) {
  if (const Node* value = member(key, false)) read_string(key, *value, field, true);
}
void ObjectReader::required(const std::string& key, std::string& field) {
  if (const Node* value = member(key, true)) read_string(key, *value, field, false);
}
void ObjectReader::optional(const std::string& key, std::filesystem::path& field) {
  std::string text = field.string();
  optional(key, text);
  field = text;
}
void ObjectReader::required(const std::string& key, std::filesystem::path& field) {
  std::string text = field.string();
  required(key, text);
  field = text;
}

std::optional<std::size_t> ObjectReader::choice(const std::string& key,
                                                std::span<const std::string> names, bool required) {
  std::string text;
  const Node* value = member(key, required);
  if (!value || !read_string(key, *value, text, false)) return std::nullopt;
  const auto found = std::find(names.begin(), names.end(), text);
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  complain(key,
           fmt::format("{} is not known; allowed are {}", value->shown(), fmt::join(names, ", ")));
  return std::nullopt;
}

void ObjectReader::array(const std::string& key, bool required, Entries entries,
                         const std::function<void(const Node&, const std::string&)>& each) {
  const Node* value = member(key, required);
  if (!value) return;
  if (value->kind != Node::Kind::array) {
    complain(key, fmt::format("is {}; an array [...] is wanted", value->shown()));
    return;
  }
  const std::size_t count = value->elements.size();
  if (count > entries.most) {
    complain(key, fmt::format("has {} entries; at most {} are read", count, entries.most));
    return;
  }
  if (count < entries.least) {
    complain(key, fmt::format("has {} entries; at least {} wanted", count, entries.least));
  }
  for (std::size_t i = 0; i < count; ++i) {
    each(value->elements[i], fmt::format("{}/{}", at(key), i));
  }
}

void ObjectReader::format(const std::string& expected) {
  member("$schema", false);  // for editors, which use it for completion
  std::string text = expected;
  optional("format", text);
  if (text == expected) return;
  const std::string family = expected.substr(0, expected.find('/') + 1);
  complain(
      "format",
      text.starts_with(family)
          ? fmt::format("\"{}\" is another version; this program reads \"{}\"", text, expected)
          : fmt::format("\"{}\" is another kind of file; \"{}\" is wanted here", text, expected));
  if (!text.starts_with(family)) findings_.close();
}

void ObjectReader::finish() {
  std::vector<std::string> unused;
  for (const std::string& name : known_) {
    if (!node_.find(name) && !name.starts_with('$')) unused.push_back(name);
  }
  std::ranges::sort(known_);
  for (std::size_t i = 0; i < node_.keys.size(); ++i) {
    const std::string& key = node_.keys[i];
    if (std::ranges::binary_search(known_, key)) continue;
    findings_.add(node_.elements[i], at(key),
                  "unknown key; " + (findings_.full() ? "" : suggestion(key, unused)));
  }
}

}  // namespace shaker::config
