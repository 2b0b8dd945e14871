#include "cli/watched_socket.hpp"

#include <cstdio>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <unistd.h>

namespace shaker::cli {
namespace {

constexpr unsigned long kListens = 0x10000;  // __SO_ACCEPTCON among the flags of /proc/net/unix

// Reads the kernel's list: a connection would start what is not there.
bool somebody_listens(const std::filesystem::path& socket) {
  std::ifstream list("/proc/net/unix");
  const std::string ending = " " + socket.string();
  for (std::string line; std::getline(list, line);) {
    if (!line.ends_with(ending)) continue;
    char address[64], references[64], protocol[64];
    unsigned long flags = 0;
    if (std::sscanf(line.c_str(), "%63s %63s %63s %lx", address, references, protocol, &flags) ==
            4 &&
        (flags & kListens) != 0)
      return true;
  }
  return false;
}

}  // namespace

std::filesystem::path view_socket_of(const std::filesystem::path& commanding) {
  const auto service = [](const std::filesystem::path& folder) {
    return folder.filename() == "shakerd";
  };
  if (commanding.filename() != "shakerd.sock") return {};
  const auto folder = commanding.parent_path(), above = folder.parent_path();
  if (service(folder)) return above / "shakerd-view" / "view.sock";
  if (service(above)) return above.parent_path() / "shakerd-view" / folder.filename() / "view.sock";
  return {};
}

Result<StreamClient> connect_to_watch(const std::filesystem::path& commanding) {
  const auto view = view_socket_of(commanding);
  std::error_code none;
  if (view.empty() || !std::filesystem::exists(view, none))
    return StreamClient::connect(commanding);
  if (!somebody_listens(view))
    return Error{
        ErrorKind::unavailable,
        fmt::format("{}: the daemon is stopped; start it with `systemctl start`, or with a "
                    "command that needs it",
                    view.string())};
  const bool allowed = ::access(view.c_str(), R_OK | W_OK) == 0;
  return StreamClient::connect(allowed ? view : commanding);
}

}  // namespace shaker::cli
