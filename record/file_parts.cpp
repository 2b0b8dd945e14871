#include "record/file_parts.hpp"

#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

#include "base/unique_fd.hpp"

namespace shaker::record {
namespace fs = std::filesystem;

NamedFile::NamedFile(std::string path) : path_(std::move(path)) {
  struct stat status {};
  if (::stat(path_.c_str(), &status) != 0) return;
  device_ = status.st_dev;
  inode_ = status.st_ino;
}

bool NamedFile::still_named() const {
  struct stat status {};
  return ::stat(path_.c_str(), &status) == 0 && status.st_dev == device_ && status.st_ino == inode_;
}

fs::path aside_name(const fs::path& file, const std::string& kind, const std::string& now_utc) {
  std::string stamp = now_utc;
  std::erase_if(stamp, [](char c) { return c == ':' || c == '.'; });
  const std::string name = file.string() + "." + kind + "-" + stamp;
  const auto taken = [](const std::string& candidate) {
    for (const char* part : kParts) {
      std::error_code trouble;
      const auto status = fs::symlink_status(candidate + part, trouble);
      if (status.type() != fs::file_type::not_found) return true;
    }
    return false;
  };
  std::string candidate = name;
  for (int i = 2; taken(candidate) && i < 1000; ++i)
    candidate = fmt::format("{}_{}", name, i);
  return candidate;
}

Result<void> move_parts(const fs::path& from, const fs::path& to) {
  Result<void> outcome;
  for (const char* part : kParts) {
    const std::string source = from.string() + part, target = to.string() + part;
    std::error_code trouble;
    if (fs::symlink_status(source, trouble).type() == fs::file_type::not_found) continue;
    fs::rename(source, target, trouble);
    if (trouble && outcome)
      outcome = Error{ErrorKind::io,
                      fmt::format("{}: cannot be renamed ({}); check that this user may write in "
                                  "the data directory.",
                                  source, trouble.message())};
  }
  return outcome;
}

Result<void> copy_part(const fs::path& from, const fs::path& to) {
  std::error_code trouble, ignored;
  fs::copy_file(from, to, trouble);
  if (!trouble) {
    const UniqueFd copy(::open(to.c_str(), O_RDONLY | O_CLOEXEC));
    if (!copy.valid() || ::fsync(copy.get()) != 0)
      trouble.assign(errno, std::generic_category());
    else
      return {};
  }
  if (trouble != std::errc::file_exists) fs::remove(to, ignored);
  return Error{
      trouble == std::errc::no_space_on_device ? ErrorKind::exhausted : ErrorKind::io,
      fmt::format("{}: cannot be copied to {} ({}); check free space and permissions and start "
                  "again.",
                  from.string(), to.filename().string(), trouble.message())};
}

void remove_parts(const fs::path& file) {
  std::error_code ignored;
  for (const char* part : kParts)
    fs::remove(file.string() + part, ignored);
}

}  // namespace shaker::record
