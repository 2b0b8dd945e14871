// The files of one campaign, which are moved or removed together. Private to record/.
#pragma once

#include <array>
#include <filesystem>
#include <string>

#include <sys/types.h>

#include "base/result.hpp"

namespace shaker::record {

inline constexpr std::array kParts{"", "-wal", "-shm", "-journal"};

// Remembers the file that a path names at construction: an open file does not show its removal.
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

// Returns FILE.KIND-UTC, a name that no file has yet.
std::filesystem::path aside_name(const std::filesystem::path& file, const std::string& kind,
                                 const std::string& now_utc);

// Renames all existing parts, which keep their suffixes. An Error names a part that could not
// be renamed; the others are renamed nevertheless.
Result<void> move_parts(const std::filesystem::path& from, const std::filesystem::path& to);

// Copies and flushes one file. An Error names the remedy; the incomplete copy is then removed.
Result<void> copy_part(const std::filesystem::path& from, const std::filesystem::path& to);

// Removes all parts. Only for files that never had contents, or for copies.
void remove_parts(const std::filesystem::path& file);

}  // namespace shaker::record
