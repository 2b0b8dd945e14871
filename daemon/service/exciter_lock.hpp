// Lock that gives an exciter to one daemon only. Two daemons must not command the same table.
//
// Two kinds of daemon must detect each other. The *service* runs as the user that owns the
// folder /run/shakerd; a *plain* daemon is started by any user (./demo, a shell).
//
//   the service   locks a file in its folder that nobody else can open, so that nobody can prevent
//                 its start, and listens on a socket there by which anybody can see it alive.
//   both          bind the exciter's name as an abstract socket: exclusive on this PC (within one
//                 network namespace) and released with the process, however that ends. The kernel
//                 reports the holder (SO_PEERCRED).
//
// A plain daemon refuses to start if either is taken. The service refuses if root or its own
// user holds the name. It asks the daemon of any other user to end; that daemon ramps down and
// ends, and the service starts then. A holder that does not end within `patience` is not a
// shakerd, or hangs and sends nothing: the service reports this and starts nevertheless.
//
// A hostile user of this PC can still hold a name, so that plain daemons of other users do not
// start and the service starts late by `patience`. If the network permits it, such a user can
// also talk to the exciter directly. A network namespace (a container) counts as another PC.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include <sys/types.h>

#include "base/clock.hpp"
#include "base/result.hpp"

namespace shaker::daemon {

struct LockPlace {
  std::filesystem::path folder = "/run/shakerd";  // the service's folder
  bool service = false;                           // this process is the service
  Nanoseconds patience = std::chrono::seconds(15);
};
// The owner of the folder decides whether this process is the service.
LockPlace lock_place_of_this_process();

class ExciterLock {
 public:
  // Called at most once, on a thread of the lock: the service, run by `who`, requests the
  // exciter. The function should only end this daemon gently.
  using LetGo = std::function<void(const std::string& who)>;
  // `address`: see exciter_address.hpp. Returns the Error `refused` if another daemon has the
  // exciter. Only the service waits, at most about `patience`. The lock is held until the
  // object is destroyed. A plain daemon's lock starts a thread.
  static Result<std::unique_ptr<ExciterLock>> take(const std::string& address,
                                                   const LockPlace& place, LetGo let_go);
  virtual ~ExciterLock() = default;
  ExciterLock(const ExciterLock&) = delete;
  ExciterLock& operator=(const ExciterLock&) = delete;

 protected:
  ExciterLock() = default;
};

}  // namespace shaker::daemon
