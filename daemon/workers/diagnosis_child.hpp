// One diagnosis in a process of its own, so that no crash and no want of memory of it is the
// daemon's.
//
// The program reads the job as a JSON object from its standard input: "parent" (the daemon's
// process id), "database", "folder", "false_alarm_rate", "thorough" and, where one is given, "model"
// (its file's text). It writes a line of JSON for each step, {"type": "progress", "campaign",
// "stage", "share"}, and one at its end, {"type": "result", "campaign", "status", "reason",
// "folder", "diagnosis"}. It inherits standard input, output and error and no other descriptor, no
// blocked and no ignored signal. It lowers its own priority and memory, and dies with the thread
// that started it.
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
  // The first of `places` that can be started. Neither blocks nor throws.
  static Result<DiagnosisChild> start(const std::vector<std::filesystem::path>& places,
                                      const std::string& job);
  DiagnosisChild(DiagnosisChild&& other) noexcept;
  DiagnosisChild& operator=(DiagnosisChild&&) = delete;
  ~DiagnosisChild();  // kills it; waits for its end, 2 s at most

  // Waits some 50 ms at most for what it writes. Gives whole lines; false: it has closed its output.
  // An Error: it writes more than a diagnosis can be.
  Result<bool> read(const std::function<void(const std::string& line)>& take);

  // How it ended, in words: "signal 9 (Killed)", "status 1". Kills it where it does not end by
  // itself within a second.
  std::string end();

 private:
  DiagnosisChild(pid_t process, UniqueFd output) : process_(process), output_(std::move(output)) {}
  bool ended_within(int milliseconds, int& status);

  pid_t process_ = -1;  // -1: none, or it has been waited for
  UniqueFd output_;
  std::string line_;
  std::size_t total_ = 0;
};

}  // namespace shaker::daemon
