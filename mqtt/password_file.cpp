#include "mqtt/password_file.hpp"

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/unique_fd.hpp"

namespace shaker::mqtt {
namespace {

constexpr std::size_t kMaxPassword = 1000;

}  // namespace

Result<std::string> read_password(const std::filesystem::path& file) {
  const std::string name = file.string();
  const UniqueFd fd(::open(name.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  if (!fd.valid() || ::fstat(fd.get(), &status) != 0)
    return Error{ErrorKind::invalid, fmt::format("{}: {}", name, std::strerror(errno))};
  if (!S_ISREG(status.st_mode))
    return Error{ErrorKind::invalid, fmt::format("{}: is not a file", name)};
  if ((status.st_mode & S_IROTH) != 0)
    return Error{ErrorKind::invalid,
                 fmt::format("{0}: everybody can read the password; `chmod o-r {0}`", name)};
  std::string text(kMaxPassword + 2, '\0');
  const ssize_t got = ::read(fd.get(), text.data(), text.size());
  if (got < 0) return Error{ErrorKind::invalid, fmt::format("{}: {}", name, std::strerror(errno))};
  text.resize(static_cast<std::size_t>(got));
  text = text.substr(0, text.find('\n'));
  if (text.ends_with('\r')) text.pop_back();
  if (text.empty() || text.size() > kMaxPassword)
    return Error{
        ErrorKind::invalid,
        fmt::format("{}: its first line is the password, of 1 to {} bytes", name, kMaxPassword)};
  return text;
}

}  // namespace shaker::mqtt
