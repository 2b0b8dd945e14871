#include "daemon/service/rig_lock.hpp"

#include <cerrno>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <system_error>

#include "daemon/service/exciter_address.hpp"

namespace shaker::daemon {
namespace {

// The lock is a file that only its owner may open: whoever may read the directory, as the group that
// commands the rig may, could lock the directory itself and keep the service down.
Result<UniqueFd> lock_directory(const std::filesystem::path& path) {
  std::error_code ignored;
  std::filesystem::create_directories(path, ignored);
  const auto file = path / ".lock";
  UniqueFd fd(::open(file.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600));
  if (!fd.valid()) {
    return Error{
        ErrorKind::io,
        fmt::format(
            "{}: cannot be opened ({}); check that the directory exists, and that this user "
            "may write in it and made that file.",
            file.string(), std::generic_category().message(errno))};
  }
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) {
    return Error{ErrorKind::refused,
                 fmt::format("{}: another shakerd records in this directory; stop that one first "
                             "(systemctl stop shakerd), or give this one another with --data.",
                             path.string())};
  }
  return fd;
}

}  // namespace

Result<RigLock> RigLock::take(const config::RigConfig& rig, const std::filesystem::path& data,
                              const LockPlace& place, ExciterLock::LetGo let_go) {
  RigLock held;
  auto directory = lock_directory(data);
  if (!directory) return directory.error();
  held.data_ = std::move(*directory);
  const auto address = exciter_address(rig);
  if (!address) return address.error();
  if (*address) {
    auto exciter = ExciterLock::take(**address, place, std::move(let_go));
    if (!exciter) return exciter.error();
    held.exciter_ = std::move(*exciter);
  }
  return held;
}

}  // namespace shaker::daemon
