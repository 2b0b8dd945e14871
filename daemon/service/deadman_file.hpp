// Stores the proof that the exciter's dead-man works in the daemon's directory, with date, user
// and method. The proof holds for the text of the rig file at that time; another text requires
// a new one.
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
  // `rig` is the rig file, which is read here; `directory` is the daemon's own.
  DeadmanFile(const std::filesystem::path& directory, const std::filesystem::path& rig);

  // The proof for this rig file; empty if there is none or it cannot be read.
  std::optional<Engine::DeadmanSeen> load() const;
  Result<void> save(const Engine::DeadmanSeen& seen, const std::string& user,
                    Nanoseconds utc) const;

 private:
  std::filesystem::path file_;
  std::string rig_text_hash_;
};

}  // namespace shaker::daemon
