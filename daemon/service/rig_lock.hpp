// One daemon for each exciter and for each directory of databases: held as long as this lives, and
// gone with the process however it ends.
#pragma once

#include <filesystem>
#include <memory>

#include "base/result.hpp"
#include "base/unique_fd.hpp"
#include "config/rig.hpp"
#include "daemon/service/exciter_lock.hpp"

namespace shaker::daemon {

class RigLock {
 public:
  // `refused` when another daemon holds either. To be called before anything is sent to a device.
  static Result<RigLock> take(const config::RigConfig& rig, const std::filesystem::path& data,
                              const LockPlace& place, ExciterLock::LetGo let_go);

 private:
  std::unique_ptr<ExciterLock> exciter_;  // none for a device that moves nothing
  UniqueFd data_;
};

}  // namespace shaker::daemon
