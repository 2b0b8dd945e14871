// Listening sockets for clients. An Error names the address and the remedy.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.hpp"
#include "base/unique_fd.hpp"

namespace shaker::daemon {

// Opens a Unix stream socket, mode 0660, with that group if it exists. Replaces the socket file
// of a dead daemon; returns an Error if a daemon answers on it. `option` is for messages.
Result<UniqueFd> listen_unix(const std::filesystem::path& path, const char* option = "--socket",
                             const char* group = "shaker");

// Opens a TCP socket on 127.0.0.1. With port 0 the kernel chooses; `bound_port` returns the
// port.
Result<UniqueFd> listen_tcp(int port);
int bound_port(const UniqueFd& socket);

struct InheritedSocket {
  UniqueFd fd;
  bool read_only = false;  // TCP, or FileDescriptorName=view
};
// Stream sockets passed by systemd (sd_listen_fds); none if systemd did not start this process.
std::vector<InheritedSocket> inherited_sockets();

}  // namespace shaker::daemon
