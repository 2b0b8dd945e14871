// Reads the lines of a file through one buffer of fixed size.
//
// A line longer than the buffer (16 KiB) is returned in parts. The parser then finds them
// malformed, and nothing is read beyond the buffer.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.hpp"
#include "base/unique_fd.hpp"

namespace shaker::drivers::replay {

class LineReader {
 public:
  Result<void> open(const std::filesystem::path& file);
  // Returns the next line without its line end, valid until the next call; nothing at the end
  // of the file.
  std::optional<std::string_view> next();
  // Empty, or the reason why reading ended before the end of the file.
  const std::string& trouble() const { return trouble_; }

 private:
  bool fill();

  UniqueFd fd_;
  std::string trouble_;
  std::array<char, 16384> buffer_;
  std::size_t begin_ = 0, end_ = 0;
  bool at_end_ = false;
};

}  // namespace shaker::drivers::replay
