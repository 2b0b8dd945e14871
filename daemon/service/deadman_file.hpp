// That the exciter's dead-man was seen to act, kept in the daemon's directory with date, user and
// how. It holds for the rig file as it was then: another text asks again.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "daemon/engine.hpp"

namespace shaker::daemon {

class DeadmanFile {
 public:
  // `rig` is the rig file, read now; `directory` the daemon's own.
  DeadmanFile(const std::filesystem::path& directory, const std::filesystem::path& rig);

  // What was kept for this rig file; nothing where there is none, or it cannot be read.
  std::optional<Engine::DeadmanSeen> load() const;
  Result<void> save(const Engine::DeadmanSeen& seen, const std::string& user,
                    Nanoseconds utc) const;

 private:
  std::filesystem::path file_;
  std::string rig_text_hash_;
};

}  // namespace shaker::daemon
