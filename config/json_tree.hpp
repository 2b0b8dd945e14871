// JSON text as a tree that remembers where everything stood.
//
// nlohmann-json parses; this keeps what its own tree forgets and an operator needs: the line of
// every value, and keys that occur twice. Comments (// and /* */) are allowed. Nesting is bounded
// to kDepthMax while parsing, so that hostile input cannot exhaust the stack. The time goes with n
// log n of the text, whatever is in it: keys are sorted, not hashed.
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
  double number = 0.0;                 // also of an integer
  std::string text;                    // of a string; of a number, as it was written or nearly so
  std::vector<Node> elements;          // of an array; of an object, the values
  std::vector<std::string> keys;       // of an object, in the file's order
  std::vector<std::uint32_t> by_name;  // places in `keys`, sorted by key
  int line = 1;

  const Node* find(const std::string& key) const;  // nullptr: not an object, or no such key
  std::string shown() const;                       // for messages: "abc" (a string), 12, an object
};

// An Error names origin, line and column.
Result<Node> parse_json(const std::string& text, const std::string& origin);

// The whole of a regular file, at most `most` bytes. It neither waits for the other end of a pipe
// nor takes a terminal: what was opened is judged, not the name, which may change meanwhile. An
// Error names the file, the reason and the remedy. For every file that a client may name.
Result<std::string> read_text(const std::filesystem::path& file, std::size_t most = kFileBytesMax);

}  // namespace shaker::config
