// The connection of one who only looks on. It never starts a daemon that somebody has stopped.
//
// systemd keeps the socket that commands open while the daemon is stopped, and starts the daemon
// with the first connection. The view socket ends with the daemon. Who looks on therefore uses the
// view socket, or, without permission for it, the other one only while somebody listens at the view
// socket.
#pragma once

#include <filesystem>

#include "base/result.hpp"
#include "cli/stream_client.hpp"

namespace shaker::cli {

// The view socket of the service with this commanding socket: X/shakerd/RIG/shakerd.sock has
// X/shakerd-view/RIG/view.sock, also without RIG. Empty for another path. Pure.
std::filesystem::path view_socket_of(const std::filesystem::path& commanding);

// Connects to the view socket where there is one, otherwise to `commanding`. An Error as of
// StreamClient::connect; `unavailable` also for a daemon that is stopped.
Result<StreamClient> connect_to_watch(const std::filesystem::path& commanding);

}  // namespace shaker::cli
