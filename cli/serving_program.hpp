// The frame of a program that serves others with what the daemon says: shakerd-gateway and
// shakerd-mqtt. It reads the command line, connects to the daemon (DaemonLink), says in one sentence
// what is wrong, and ends at once when SIGTERM or SIGINT asks for it, whatever the connection waits
// for at that moment.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "base/result.hpp"
#include "cli/daemon_link.hpp"

namespace shaker::cli {

// The connections of such a program: that of --socket, and others that it asks for.
class DaemonLinks {
 public:
  DaemonLinks(std::filesystem::path socket, std::string reader, std::vector<std::string> documents)
      : socket_(std::move(socket)), reader_(std::move(reader)), documents_(std::move(documents)) {}
  // Begins to connect; the reference stays valid. Throws std::system_error without descriptors.
  DaemonLink& own() { return add(socket_); }
  DaemonLink& add(const std::filesystem::path& socket) {
    return *links_.emplace_back(std::make_unique<DaemonLink>(socket, reader_, documents_));
  }

 private:
  std::filesystem::path socket_;
  std::string reader_;
  std::vector<std::string> documents_;
  std::vector<std::unique_ptr<DaemonLink>> links_;
};

struct ServingProgram {
  std::string name{}, about{};           // "shakerd-gateway"; what --help says first
  std::string reader{};                  // "The gateway": the subject of sentences about it
  std::vector<std::string> documents{};  // to subscribe to
  // Adds the program's own options to --version and --socket.
  std::function<void(CLI::App&)> add_options{};
  // Checks and completes the options once all have been read. An Error ends the program with
  // status 2.
  std::function<Result<void>()> check{};
  // Tells systemd when it is ready, and serves until `ending` is readable (base/ending_signals.hpp).
  // An Error, or an exception, ends the program with status 1. The process ends as soon as it has
  // returned: whatever its own threads still use belongs to the caller of run_serving_program().
  std::function<Result<void>(DaemonLinks& links, int ending)> serve{};
};

// The whole of main(). Returns the exit status; once it has served it ends the process instead.
int run_serving_program(const ServingProgram& program, int argc, char** argv);

}  // namespace shaker::cli
