// One daemon for each rig: held as long as this lives, and gone with the process however it ends.
//
// The lock (flock) is on the rig file itself and on the data directory, so that neither the same
// rig nor the same databases can have two daemons.
#pragma once

#include <filesystem>

#include "base/result.hpp"
#include "base/unique_fd.hpp"

namespace shaker::daemon {

class RigLock {
 public:
  // `refused` when another daemon holds it.
  static Result<RigLock> take(const std::filesystem::path& rig, const std::filesystem::path& data);

 private:
  UniqueFd rig_, data_;
};

}  // namespace shaker::daemon
