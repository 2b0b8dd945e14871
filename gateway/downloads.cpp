#include "gateway/downloads.hpp"

#include <algorithm>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <system_error>

#include "base/clock.hpp"

namespace shaker::gateway {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kMaxListed = 200;

struct Listed {
  std::string stem;
  std::uint64_t bytes = 0;
  std::int64_t modified_ns = 0;
  bool recording = false, report = false;
};

bool is_there(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

UniqueFd opened_to_read(const fs::path& path) {
  return UniqueFd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
}

// SQLite's log holds what is not in the file yet. A reader may leave an empty one behind.
bool has_a_log(const fs::path& database) {
  std::error_code trouble;
  const auto bytes = fs::file_size(database.string() + "-wal", trouble);
  return !trouble && bytes > 0;
}

// A database that is written with a log says so in its header (SQLite's file format, offset 18),
// and a program that has it open holds a lock. The writer empties the log first, then changes the
// header, then lets the lock go.
bool is_open_with_a_log(const fs::path& database) {
  constexpr off_t kVersionAt = 18;
  constexpr char kWithLog = 2;
  const UniqueFd fd = opened_to_read(database);
  char version = 0;
  if (!fd.valid() || ::pread(fd.get(), &version, 1, kVersionAt) != 1 || version != kWithLog)
    return false;
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  return ::fcntl(fd.get(), F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
}

bool is_written(const fs::path& database) {
  return has_a_log(database) || is_open_with_a_log(database);
}

fs::path report_of(const fs::path& directory, const std::string& stem) {
  return directory / (stem + ".diagnosis") / "report.html";
}

std::vector<Listed> listed(const fs::path& directory) {
  std::vector<Listed> all;
  std::error_code trouble;
  if (directory.empty()) return all;
  for (fs::directory_iterator it(directory, trouble), end; !trouble && it != end;
       it.increment(trouble)) {
    const fs::path path = it->path();
    struct stat status {};
    if (path.extension() != ".db" || ::lstat(path.c_str(), &status) != 0 ||
        !S_ISREG(status.st_mode))
      continue;
    const std::string stem = path.stem().string();
    all.push_back({stem, static_cast<std::uint64_t>(status.st_size),
                   status.st_mtim.tv_sec * 1'000'000'000LL + status.st_mtim.tv_nsec,
                   is_written(path), is_there(report_of(directory, stem))});
  }
  std::ranges::sort(all, std::greater<>(), &Listed::modified_ns);
  if (all.size() > kMaxListed) all.resize(kMaxListed);
  return all;
}

std::optional<Download> opened(const fs::path& path) {
  Download file;
  file.fd = opened_to_read(path);
  struct stat status {};
  if (!file.fd.valid() || ::fstat(file.fd.get(), &status) != 0 || !S_ISREG(status.st_mode))
    return std::nullopt;
  file.bytes = static_cast<std::uint64_t>(status.st_size);
  return file;
}

}  // namespace

nlohmann::json Downloads::list() const {
  nlohmann::json campaigns = nlohmann::json::array();
  for (const Listed& one : listed(directory_)) {
    campaigns.push_back({{"name", one.stem},
                         {"bytes", one.bytes},
                         {"modified_utc", format_utc(Nanoseconds(one.modified_ns))},
                         {"recording", one.recording},
                         {"report", one.report}});
  }
  return {{"campaigns", std::move(campaigns)}};
}

std::optional<Download> Downloads::campaign(std::string_view name) const {
  for (const Listed& one : listed(directory_)) {
    if (!one.recording && one.stem + ".db" == name) return opened(directory_ / (one.stem + ".db"));
  }
  return std::nullopt;
}

std::optional<Download> Downloads::report(std::string_view name) const {
  for (const Listed& one : listed(directory_)) {
    if (one.report && one.stem + ".html" == name) return opened(report_of(directory_, one.stem));
  }
  return std::nullopt;
}

}  // namespace shaker::gateway
