// Parses JSON text to a tree that keeps the line of every value.
//
// nlohmann-json parses; this tree adds what an operator needs: line numbers, and the detection
// of keys that occur twice. Comments (// and /* */) are allowed. Nesting is limited to
// kDepthMax during parsing, so that hostile input cannot exhaust the stack. The time is O(n log
// n) in the length of the text for any input, because keys are sorted, not hashed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace shaker::config {

inline constexpr int kDepthMax = 32;
inline constexpr std::size_t kFileBytesMax = 1 << 20;

struct Node {
  enum class Kind { null, boolean, integer, number, string, array, object };
  Kind kind = Kind::null;
  bool boolean = false;
  double number = 0.0;                 // also for an integer
  std::string text;                    // of a string; of a number, approximately as it was written
  std::vector<Node> elements;          // of an array; for an object its values
  std::vector<std::string> keys;       // of an object, in the file's order
  std::vector<std::uint32_t> by_name;  // indexes into `keys`, sorted by key
  int line = 1;

  const Node* find(const std::string& key) const;  // nullptr: not an object, or no such key
  std::string shown() const;                       // for messages: "abc" (a string), 12, an object
};

// An Error names origin, line and column.
Result<Node> parse_json(const std::string& text, const std::string& origin);

// Reads a regular file of at most `most` bytes. Does not wait for the other end of a pipe and
// does not take a terminal; it checks the open file, not the name, which may change in between.
// An Error names the file and the reason. Use it for every file that a client may name.
Result<std::string> read_text(const std::filesystem::path& file, std::size_t most = kFileBytesMax);

}  // namespace shaker::config
