// Where clients connect. An Error names the address and the remedy.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.hpp"
#include "base/unique_fd.hpp"

namespace shaker::daemon {

// A Unix stream socket, mode 0660, of the group `shaker` where that group exists. A dead daemon's
// socket file is replaced; a living one's is an Error.
Result<UniqueFd> listen_unix(const std::filesystem::path& path);

// Loopback only. Port 0 lets the kernel choose; `bound_port` says which.
Result<UniqueFd> listen_tcp(int port);
int bound_port(const UniqueFd& socket);

// Stream sockets that systemd handed over (sd_listen_fds); none when it did not start us.
std::vector<UniqueFd> inherited_sockets();

}  // namespace shaker::daemon
