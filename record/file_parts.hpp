// The files that belong to one campaign while it is written, moved or copied together. Private to
// record/.
#pragma once

#include <array>
#include <filesystem>
#include <string>

#include <sys/types.h>

#include "base/result.hpp"

namespace shaker::record {

inline constexpr std::array kParts{"", "-wal", "-shm", "-journal"};

// Which file a path named when this was made: an open file does not notice that it is removed.
class NamedFile {
 public:
  explicit NamedFile(std::string path);
  const std::string& path() const { return path_; }
  bool still_named() const;

 private:
  std::string path_;
  dev_t device_ = 0;
  ino_t inode_ = 0;
};

// FILE.KIND-UTC, a name that nothing has yet.
std::filesystem::path aside_name(const std::filesystem::path& file, const std::string& kind,
                                 const std::string& now_utc);

// Renames all parts that there are; they lie beside `to` as they lay beside `from`. An Error names
// the part that could not be renamed.
Result<void> move_parts(const std::filesystem::path& from, const std::filesystem::path& to);

// Copies and flushes. An Error names the remedy; nothing of the copy is left then.
Result<void> copy_part(const std::filesystem::path& from, const std::filesystem::path& to);

// Only for what never held anything, or copies of what does.
void remove_parts(const std::filesystem::path& file);

}  // namespace shaker::record
