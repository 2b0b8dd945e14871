// Runs one diagnosis in a separate process, so that its crash or its lack of memory does not
// affect the daemon.
//
// The program reads the job as a JSON object from its standard input: "parent" (the daemon's
// process id), "database", "folder", "false_alarm_rate", "thorough" and, if given, "model" (the
// text of its file). It writes a line of JSON for each step, {"type": "progress", "campaign",
// "stage", "share"}, and one at its end, {"type": "result", "campaign", "status", "reason",
// "folder", "diagnosis"}. It inherits standard input, output and error and no other descriptor,
// and no blocked or ignored signal. It lowers its own priority and memory, and ends with the
// thread that started it.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <sys/types.h>

#include "base/result.hpp"
#include "base/unique_fd.hpp"

namespace shaker::daemon {

class DiagnosisChild {
 public:
  // Starts the first of `places` that can be started. Does not wait for the program's output.
  static Result<DiagnosisChild> start(const std::vector<std::filesystem::path>& places,
                                      const std::string& job);
  DiagnosisChild(DiagnosisChild&& other) noexcept;
  DiagnosisChild& operator=(DiagnosisChild&&) = delete;
  ~DiagnosisChild();  // kills it and waits for its end, 2 s at most

  // Waits at most about 50 ms for output and passes whole lines to `take`. Returns false if the
  // program has closed its output, and an Error if it has written more than 16 MiB.
  Result<bool> read(const std::function<void(const std::string& line)>& take);

  // The cause of its end: "signal 9 (Killed)", "status 1". Kills it if it does not end within a
  // second.
  std::string end();

 private:
  DiagnosisChild(pid_t process, UniqueFd output) : process_(process), output_(std::move(output)) {}
  bool ended_within(int milliseconds, int& status);

  pid_t process_ = -1;  // -1: none, or waitpid has returned
  UniqueFd output_;
  std::string line_;
  std::size_t total_ = 0;
};

}  // namespace shaker::daemon
