// Reads an object of a configuration file key by key into a struct, and reports its errors.
//
//   ObjectReader reader(node, "/limits", findings);
//   reader.optional("stale_s", limits.stale_s, above(0).at_most(10));
//   reader.finish();   // unknown keys
//
// It neither throws nor stops at the first mistake. Every finding names file, line, JSON
// pointer, the value and the allowed values; a field with a finding keeps its default. Up to
// kFindingsMax are kept. Used during parsing only; the nodes must outlive the readers.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "config/json_tree.hpp"

namespace shaker::config {

class Findings {
 public:
  static constexpr std::size_t kFindingsMax = 20;
  explicit Findings(std::string origin) : origin_(std::move(origin)) {}

  // `pointer` is a JSON pointer, empty for the whole file.
  void add(const Node& at, const std::string& pointer, const std::string& sentence);
  bool empty() const { return lines_.empty() && left_out_ == 0; }
  bool full() const { return lines_.size() == kFindingsMax; }  // further findings are only counted
  void close() { closed_ = true; }  // further findings would say the same: they are left out
  Error error() const;              // all of them, one on each line. Precondition: !empty()

 private:
  std::string origin_;
  std::vector<std::string> lines_;
  std::size_t left_out_ = 0;
  bool closed_ = false;
};

// The allowed numbers. Built by above, at_least, any_number and narrowed by the methods.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false, high_open = false;

  Range at_most(double limit) const { return {low, limit, low_open, false}; }
  Range below(double limit) const { return {low, limit, low_open, true}; }
  bool holds(double value) const;
  std::string text() const;  // "above 0 and at most 10"
};
inline Range any_number() {
  return {};
}
inline Range above(double limit) {
  return {limit, std::numeric_limits<double>::infinity(), true, false};
}
inline Range at_least(double limit) {
  return {limit, std::numeric_limits<double>::infinity(), false, false};
}

// Allowed number of entries of an array. The upper limit keeps the cost of a hostile file in
// proportion to its size.
struct Entries {
  Entries(std::size_t at_least, std::size_t at_most = 10000) : least(at_least), most(at_most) {}
  std::size_t least, most;
};

// "did you mean ...?" for a misspelt name, or the whole list if no name is near.
std::string suggestion(const std::string& wrong, std::span<const std::string> allowed);

class ObjectReader {
 public:
  // Adds a finding if `node` is not an object; then every key is absent without further
  // findings.
  ObjectReader(const Node& node, std::string pointer, Findings& findings);

  bool is_object() const { return is_object_; }
  const Node& node() const { return node_; }
  std::string at(const std::string& key) const;  // JSON pointer of a member

  // The member, or nullptr; adds a finding if it is required and absent. Marks the key as
  // known.
  const Node* member(const std::string& key, bool required);

  void optional(const std::string& key, double& field, Range range = any_number());
  void required(const std::string& key, double& field, Range range = any_number());
  void optional(const std::string& key, std::optional<double>& field, Range range = any_number());
  void optional(const std::string& key, int& field, Range range);
  void required(const std::string& key, int& field, Range range);
  void optional(const std::string& key, std::uint32_t& field);
  void optional(const std::string& key, std::uint64_t& field);
  void optional(const std::string& key, bool& field);
  void optional(const std::string& key, std::string& field);
  void required(const std::string& key, std::string& field);  // not empty
  void optional(const std::string& key, std::filesystem::path& field);
  void required(const std::string& key, std::filesystem::path& field);

  // One of `names`: returns its index, or nullopt if absent or wrong (with a finding).
  std::optional<std::size_t> choice(const std::string& key, std::span<const std::string> names,
                                    bool required);

  // Calls `each(member, pointer)`. Adds a finding if it is not an array or has a wrong number
  // of entries; if there are too many, none is read.
  void array(const std::string& key, bool required, Entries entries,
             const std::function<void(const Node&, const std::string&)>& each);

  // "format" is optional, but must have this value if present.
  void format(const std::string& expected);

  void complain(const std::string& key, const std::string& sentence);
  void finish();  // adds a finding for each unknown key

 private:
  void read_number(const std::string& key, const Node& value, double& field, Range range);
  bool read_integer(const std::string& key, const Node& value, double& field, Range range);
  bool read_string(const std::string& key, const Node& value, std::string& field, bool empty_ok);

  const Node& node_;
  std::string pointer_;
  Findings& findings_;
  bool is_object_;
  std::vector<std::string> known_;
};

}  // namespace shaker::config
