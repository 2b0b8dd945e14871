// Accepts requests for a diagnosis: checks whether it may run now, and finds its campaign and
// its output folder.
//
// Reads and writes in the daemon's own directory only, so that a client cannot make it touch
// other files. Called on the clients' thread; blocks while it reads that directory.
#pragma once

#include <atomic>
#include <filesystem>
#include <string>

#include "base/result.hpp"
#include "daemon/publish/commands.hpp"
#include "daemon/state_table.hpp"
#include "daemon/workers/diagnosis_thread.hpp"

namespace shaker::daemon {

class DiagnosisDesk {
 public:
  // `thread` and `checking` outlive it. While `checking` is true, files are being recovered.
  DiagnosisDesk(DiagnosisThread& thread, std::filesystem::path directory,
                const std::atomic<bool>& checking)
      : thread_(thread), directory_(std::move(directory)), checking_(checking) {}

  // Returns an Error for the operator if the rig is not at rest, files are being recovered,
  // another diagnosis runs, there is no such campaign, or the folder or the model is invalid.
  Result<DiagnosisPlace> begin(const DiagnosisRequest& request, State state);
  Result<void> cancel(const std::string& who);
  // A campaign has priority: cancels a running diagnosis as soon as the rig is not at rest.
  void watch(State state);

 private:
  DiagnosisThread& thread_;
  std::filesystem::path directory_;
  const std::atomic<bool>& checking_;
};

}  // namespace shaker::daemon
