#include "daemon/service/rig_lock.hpp"

#include <cerrno>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <system_error>

namespace shaker::daemon {
namespace {

Result<UniqueFd> lock(const std::filesystem::path& path, int flags, const char* what) {
  UniqueFd fd(::open(path.c_str(), flags | O_CLOEXEC));
  if (!fd.valid()) {
    return Error{
        ErrorKind::io,
        fmt::format("{}: cannot be opened ({}); check that it exists and that this user may.",
                    path.string(), std::generic_category().message(errno))};
  }
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) {
    return Error{ErrorKind::refused, fmt::format("{}: another shakerd {}; stop that one first "
                                                 "(systemctl stop shakerd), there can be only one.",
                                                 path.string(), what)};
  }
  return fd;
}

}  // namespace

Result<RigLock> RigLock::take(const std::filesystem::path& rig, const std::filesystem::path& data) {
  RigLock held;
  auto first = lock(rig, O_RDONLY, "drives this rig");
  if (!first) return first.error();
  held.rig_ = std::move(*first);
  std::error_code ignored;
  std::filesystem::create_directories(data, ignored);
  auto second = lock(data, O_RDONLY | O_DIRECTORY, "records in this directory");
  if (!second) return second.error();
  held.data_ = std::move(*second);
  return held;
}

}  // namespace shaker::daemon
