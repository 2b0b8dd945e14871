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
  std::optional<int> tcp;
  bool check = false;
};

// The options, or the status to leave with (help, version and complaints have been printed).
std::variant<Options, int> parse_options(int argc, char** argv);

// Exit statuses. kTaken: another daemon has the exciter or the directory; nothing was sent.
inline constexpr int kGood = 0, kTrouble = 1, kBadInput = 2, kTaken = 3;

const char* program_version();

}  // namespace shaker::daemon
