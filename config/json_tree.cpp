#include "config/json_tree.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <numeric>
#include <tuple>

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <unistd.h>

#include "base/unique_fd.hpp"

namespace shaker::config {
namespace {

constexpr std::size_t kShownKey = 80;  // bytes of a key in a message

// Tells the tree builder how far the lexer has read, which the events of nlohmann-json do not
// contain.
class CountingIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  CountingIterator(const char* at, const char** furthest) : at_(at), furthest_(furthest) {}
  reference operator*() const { return *at_; }
  CountingIterator& operator++() {
    *furthest_ = ++at_;
    return *this;
  }
  CountingIterator operator++(int) {
    CountingIterator before = *this;
    ++*this;
    return before;
  }
  bool operator==(const CountingIterator& other) const { return at_ == other.at_; }
  bool operator!=(const CountingIterator& other) const { return at_ != other.at_; }

 private:
  const char* at_;
  const char** furthest_;
};

class TreeBuilder final : public nlohmann::json_sax<nlohmann::json> {
 public:
  TreeBuilder(const std::string& text, const std::string& origin)
      : origin_(origin), counted_(text.data()), furthest_(text.data()) {}

  const char** furthest() { return &furthest_; }
  Node& root() { return root_; }
  const std::string& error() const { return error_; }

  bool null() override { return add(Node{}); }
  bool boolean(bool value) override {
    Node node;
    node.kind = Node::Kind::boolean;
    node.boolean = value;
    return add(std::move(node));
  }
  bool number_integer(number_integer_t value) override { return add_integer(value); }
  bool number_unsigned(number_unsigned_t value) override { return add_integer(value); }
  bool number_float(number_float_t value, const string_t& spelling) override {
    Node node;
    node.kind = Node::Kind::number;
    node.number = value;
    node.text = spelling;
    return add(std::move(node));
  }
  bool string(string_t& value) override {
    Node node;
    node.kind = Node::Kind::string;
    node.text = std::move(value);
    return add(std::move(node));
  }
  bool binary(binary_t&) override { return false; }  // does not occur in text
  bool start_object(std::size_t) override { return open(Node::Kind::object); }
  bool start_array(std::size_t) override { return open(Node::Kind::array); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& value) override {
    open_.back()->keys.push_back(std::move(value));
    return true;
  }

  bool parse_error(std::size_t, const std::string& token,
                   const nlohmann::json::exception& ex) override {
    const int at = line();
    // The column counts bytes since the last line break.
    const auto column = furthest_ - line_start_;
    std::string reason = ex.what();
    if (const auto colon = reason.find("; last read: "); colon != std::string::npos) {
      reason.erase(0, reason.rfind(": ", colon) + 2);
      reason.erase(std::min(reason.find("; last read: "), reason.size()));
    } else if (const auto dash = reason.find(" - "); dash != std::string::npos) {
      reason.erase(0, dash + 3);
    } else if (const auto bracket = reason.find("] "); bracket != std::string::npos) {
      reason.erase(0, bracket + 2);
    }
    error_ = fmt::format("{}:{}:{}: not valid JSON: {}{}", origin_, at, column, reason,
                         token.empty() ? "" : fmt::format(" (at '{}')", printable(token)));
    return false;
  }

 private:
  // The end of a number is known only one character later, which may be the line break.
  // Therefore the last character that was read is not counted. No token ends with a line break.
  int line() {
    for (; counted_ + 1 < furthest_; ++counted_) {
      if (*counted_ == '\n') {
        ++line_;
        line_start_ = counted_ + 1;
      }
    }
    return line_;
  }

  static std::string printable(const std::string& token) {
    std::string out;
    for (const char c : token.substr(token.size() > 40 ? token.size() - 40 : 0)) {
      out += static_cast<unsigned char>(c) >= 0x20 && c != 0x7f ? std::string(1, c) : " ";
    }
    return out;
  }

  template <class T>
  bool add_integer(T value) {
    Node node;
    node.kind = Node::Kind::integer;
    node.number = static_cast<double>(value);
    node.text = std::to_string(value);
    return add(std::move(node));
  }

  bool add(Node node) {
    node.line = line();
    if (open_.empty()) {
      root_ = std::move(node);
    } else {
      open_.back()->elements.push_back(std::move(node));
    }
    return true;
  }

  bool open(Node::Kind kind) {
    if (static_cast<int>(open_.size()) >= kDepthMax) {
      error_ = fmt::format("{}:{}: nested deeper than {} levels", origin_, line(), kDepthMax);
      return false;
    }
    Node node;
    node.kind = kind;
    add(std::move(node));
    // The pointer stays valid while its object is open: siblings are added only after it has
    // closed.
    open_.push_back(open_.empty() ? &root_ : &open_.back()->elements.back());
    return true;
  }

  bool close() {
    Node& closed = *open_.back();
    open_.pop_back();
    return sort_keys(closed);
  }

  // Returns false if a key occurs twice.
  bool sort_keys(Node& object) {
    const auto& keys = object.keys;
    object.by_name.resize(keys.size());
    std::iota(object.by_name.begin(), object.by_name.end(), 0U);
    std::ranges::sort(object.by_name, [&](std::uint32_t a, std::uint32_t b) {
      return std::tie(keys[a], a) < std::tie(keys[b], b);
    });
    const auto twice = std::ranges::adjacent_find(
        object.by_name, [&](std::uint32_t a, std::uint32_t b) { return keys[a] == keys[b]; });
    if (twice == object.by_name.end()) return true;
    const std::uint32_t second = *std::next(twice);
    error_ = fmt::format("{}:{}: key \"{}\" occurs twice in one object; remove one", origin_,
                         object.elements[second].line, keys[second].substr(0, kShownKey));
    return false;
  }

  const std::string& origin_;
  const char* counted_;
  const char* furthest_;
  const char* line_start_ = counted_;
  int line_ = 1;
  Node root_;
  std::vector<Node*> open_;
  std::string error_;
};

}  // namespace

const Node* Node::find(const std::string& key) const {
  const auto at = std::ranges::lower_bound(
      by_name, key, {}, [&](std::uint32_t i) -> const std::string& { return keys[i]; });
  return at == by_name.end() || keys[*at] != key ? nullptr : &elements[*at];
}

std::string Node::shown() const {
  switch (kind) {
    case Kind::null:
      return "null";
    case Kind::boolean:
      return boolean ? "true" : "false";
    case Kind::integer:
    case Kind::number:
      return text;
    case Kind::string:
      return fmt::format("\"{}\"", text.size() > 60 ? text.substr(0, 57) + "..." : text);
    case Kind::array:
      return "an array";
    case Kind::object:
      return "an object";
  }
  return {};
}

Result<Node> parse_json(const std::string& text, const std::string& origin) {
  if (text.size() > kFileBytesMax) {
    return Error{ErrorKind::invalid, fmt::format("{}: {} bytes; at most {} are read", origin,
                                                 text.size(), kFileBytesMax)};
  }
  TreeBuilder builder(text, origin);
  const char* end = text.data() + text.size();
  const bool good = nlohmann::json::sax_parse(
      CountingIterator(text.data(), builder.furthest()), CountingIterator(end, builder.furthest()),
      &builder, nlohmann::json::input_format_t::json, /*strict=*/true, /*ignore_comments=*/true);
  if (!good) return Error{ErrorKind::invalid, builder.error()};
  return std::move(builder.root());
}

Result<std::string> read_text(const std::filesystem::path& file, std::size_t most) {
  const auto trouble = [&](const std::string& why) {
    return Error{ErrorKind::io, fmt::format("{}: {}", file.string(), why)};
  };
  const UniqueFd fd(::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (!fd.valid()) return trouble(fmt::format("cannot be read: {}", std::strerror(errno)));
  struct stat about {};
  if (::fstat(fd.get(), &about) != 0) return trouble(std::strerror(errno));
  if (S_ISDIR(about.st_mode)) return trouble("is a directory, not a file");
  if (!S_ISREG(about.st_mode)) {
    return trouble("is not a regular file (a pipe, a socket or a device); give the path of a file");
  }
  std::string text(most + 1, '\0');
  std::size_t size = 0;
  while (size < text.size()) {
    const ssize_t got = ::read(fd.get(), text.data() + size, text.size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return trouble(fmt::format("cannot be read: {}", std::strerror(errno)));
    if (got == 0) break;
    size += static_cast<std::size_t>(got);
  }
  text.resize(size);
  if (text.starts_with("SQLite format 3"))
    return Error{
        ErrorKind::invalid,
        fmt::format("{}: is a campaign database, and a JSON file is wanted here", file.string())};
  if (size <= most) return text;
  return Error{ErrorKind::invalid,
               fmt::format("{}: larger than {} bytes, which is too large for such a file",
                           file.string(), most)};
}

}  // namespace shaker::config
