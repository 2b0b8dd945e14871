// Locks an exciter and a directory of databases for one daemon. The lock lasts as long as this
// object and is released with the process, however that ends.
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
  // Returns the Error `refused` if another daemon holds either. Call before anything is sent to
  // a device.
  static Result<RigLock> take(const config::RigConfig& rig, const std::filesystem::path& data,
                              const LockPlace& place, ExciterLock::LetGo let_go);

 private:
  std::unique_ptr<ExciterLock> exciter_;  // null for a device that moves nothing
  UniqueFd data_;
};

}  // namespace shaker::daemon
