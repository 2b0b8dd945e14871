#include "daemon/publish/listener.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <system_error>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include "daemon/publish/user_name.hpp"

namespace shaker::daemon {
namespace {

constexpr int kBacklog = 16;

std::string reason() {
  return std::generic_category().message(errno);
}

const sockaddr* generic(const void* address) {
  return static_cast<const sockaddr*>(address);
}

Result<UniqueFd> stream_socket(int family) {
  UniqueFd fd(::socket(family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd.valid()) return Error{ErrorKind::io, "A socket cannot be made: " + reason() + "."};
  return fd;
}

// True if a process accepts connections there.
bool alive(const sockaddr_un& address) {
  const UniqueFd probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  return probe.valid() && ::connect(probe.get(), generic(&address), sizeof address) == 0;
}

}  // namespace

Result<UniqueFd> listen_unix(const std::filesystem::path& path, const char* option,
                             const char* group) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string text = path.string();
  if (text.empty() || text.size() >= sizeof address.sun_path) {
    return Error{ErrorKind::invalid, fmt::format("{} {}: a socket's path has 1 to {} bytes.",
                                                 option, text, sizeof address.sun_path - 1)};
  }
  std::memcpy(address.sun_path, text.data(), text.size());
  if (alive(address)) {
    return Error{ErrorKind::refused,
                 fmt::format("{} {}: another shakerd answers there; stop it, or give this one "
                             "another socket.",
                             option, text)};
  }
  auto fd = stream_socket(AF_UNIX);
  if (!fd) return fd;
  std::error_code ignored;
  if (std::filesystem::is_socket(path, ignored)) std::filesystem::remove(path, ignored);
  // The umask prevents connections between bind and chmod.
  const mode_t before = ::umask(0117);
  const int bound = ::bind(fd->get(), generic(&address), sizeof address);
  ::umask(before);
  if (bound != 0) {
    return Error{ErrorKind::io,
                 fmt::format("{} {}: cannot be made ({}); check that its directory exists and "
                             "that this user may write in it.",
                             option, text, reason())};
  }
  if (const auto owner = group_id(group)) {
    if (::chown(text.c_str(), static_cast<uid_t>(-1), *owner) != 0) {
      // This user is not in the group. The socket then belongs to this user only, which is
      // safe.
    }
  }
  if (::listen(fd->get(), kBacklog) != 0) {
    return Error{ErrorKind::io, fmt::format("{} {}: {}.", option, text, reason())};
  }
  return fd;
}

Result<UniqueFd> listen_tcp(int port) {
  auto fd = stream_socket(AF_INET);
  if (!fd) return fd;
  const int yes = 1;
  ::setsockopt(fd->get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::bind(fd->get(), generic(&address), sizeof address) != 0 ||
      ::listen(fd->get(), kBacklog) != 0) {
    return Error{ErrorKind::io,
                 fmt::format("--tcp {}: cannot listen on 127.0.0.1 ({}); choose a port "
                             "that is free.",
                             port, reason())};
  }
  return fd;
}

int bound_port(const UniqueFd& socket) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  void* raw = &address;
  if (::getsockname(socket.get(), static_cast<sockaddr*>(raw), &size) != 0) return 0;
  return ntohs(address.sin_port);
}

std::vector<InheritedSocket> inherited_sockets() {
  std::vector<InheritedSocket> sockets;
  char** names = nullptr;
  const int count = ::sd_listen_fds_with_names(1, &names);
  for (int i = 0; i < count; ++i) {
    const std::string name = names[i];
    std::free(names[i]);
    UniqueFd owned(SD_LISTEN_FDS_START + i);
    const int fd = owned.get();
    if (::sd_is_socket(fd, AF_UNSPEC, SOCK_STREAM, 1) <= 0) continue;
    ::fcntl(fd, F_SETFL, ::fcntl(fd, F_GETFL) | O_NONBLOCK);
    const bool local = ::sd_is_socket(fd, AF_UNIX, SOCK_STREAM, 1) > 0;
    sockets.push_back({std::move(owned), !local || name == "view"});
  }
  std::free(names);
  return sockets;
}

}  // namespace shaker::daemon
