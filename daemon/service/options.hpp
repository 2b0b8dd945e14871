// The command line of shakerd.
#pragma once

#include <filesystem>
#include <optional>
#include <variant>

namespace shaker::daemon {

struct Options {
  std::filesystem::path rig;
  std::filesystem::path socket = "/run/shakerd/shakerd.sock";
  std::filesystem::path data = "/var/lib/shakerd";
  std::optional<std::filesystem::path> view_socket;
  std::optional<int> tcp;
  bool check = false;
};

// Returns the options, or the exit status after help, version or error messages were printed.
std::variant<Options, int> parse_options(int argc, char** argv);

// Exit statuses. kTaken: another daemon has the exciter or the directory; nothing was sent to a
// device.
inline constexpr int kGood = 0, kTrouble = 1, kBadInput = 2, kTaken = 3;

const char* program_version();

}  // namespace shaker::daemon
