#include "daemon/service/used_rig.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/unique_fd.hpp"

namespace shaker::daemon {

std::filesystem::path used_rig_file() {
  const char* folder = std::getenv("RUNTIME_DIRECTORY");  // systemd.exec(5)
  return folder ? std::filesystem::path(folder) / "rig.json" : std::filesystem::path();
}

Result<void> keep_used_rig(const std::filesystem::path& file, const std::string& text) {
  if (file.empty()) return {};
  const auto trouble = [&] {
    return Error{ErrorKind::io,
                 fmt::format("{}: the copy of the rig file cannot be written ({}); a stop after "
                             "this daemon goes by the rig file itself",
                             file.string(), std::strerror(errno))};
  };
  const std::string fresh = file.string() + ".new";
  ::unlink(fresh.c_str());
  const UniqueFd fd(::open(fresh.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0640));
  if (!fd.valid()) return trouble();
  const auto written = ::write(fd.get(), text.data(), text.size());
  if (written != static_cast<ssize_t>(text.size())) return trouble();
  if (::rename(fresh.c_str(), file.c_str()) != 0) return trouble();
  return {};
}

}  // namespace shaker::daemon
