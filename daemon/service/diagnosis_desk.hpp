// Where a diagnosis is asked for: may it be done now, of which campaign, and where to?
//
// Reads and writes in the daemon's own directory alone, so that a client can make it touch nothing
// else. On the clients' thread; blocks for a look into that directory.
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
  // `thread` and `checking` outlive it: while the latter is true, files are being recovered.
  DiagnosisDesk(DiagnosisThread& thread, std::filesystem::path directory,
                const std::atomic<bool>& checking)
      : thread_(thread), directory_(std::move(directory)), checking_(checking) {}

  // An Error is the sentence to show: the rig is not at rest, another is under way, there is no
  // such campaign, a bad model.
  Result<DiagnosisPlace> begin(const DiagnosisRequest& request, State state);
  Result<void> cancel(const std::string& who);
  // A campaign comes first: ends what is under way as soon as the rig is not at rest.
  void watch(State state);

 private:
  DiagnosisThread& thread_;
  std::filesystem::path directory_;
  const std::atomic<bool>& checking_;
};

}  // namespace shaker::daemon
