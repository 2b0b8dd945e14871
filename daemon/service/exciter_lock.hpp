// One daemon for one exciter: two that command the same table would fight over it.
//
// Two kinds of daemon have to see each other. The *service* runs as the user that owns the folder
// /run/shakerd; a *plain* daemon is anybody's (./demo, a shell).
//
//   the service   locks a file in its folder that nobody else can open, so that nobody can keep it
//                 from starting, and listens on a socket there that anybody can see to be alive.
//   both          bind the exciter's name as an abstract socket: exclusive on this PC (of one
//                 network namespace) and gone with the process, however that ends. The kernel says
//                 who holds it (SO_PEERCRED).
//
// A plain daemon refuses when either is taken. The service refuses when root or its own user holds
// the name; it asks anybody else's daemon to end, which ramps down and goes, and starts when that
// is gone. Who does not go within `patience` is no daemon of ours, or hangs and sends nothing: the
// service says so and starts all the same.
//
// What a hostile user of this PC can still do: hold a name, so that other users' plain daemons do
// not start and the service starts late by `patience`; and, when the network lets him reach it,
// talk to the exciter without any daemon. A network namespace of its own (a container) is another
// PC.
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
  std::filesystem::path folder = "/run/shakerd";  // the service's own
  bool service = false;                           // this process is the service
  Nanoseconds patience = std::chrono::seconds(15);
};
// By who owns the folder.
LockPlace lock_place_of_this_process();

class ExciterLock {
 public:
  // Called at most once, on a thread of the lock's own: the service wants the exciter, which `who`
  // runs. To end this daemon gently is all that it should do.
  using LetGo = std::function<void(const std::string& who)>;
  // `address`: see exciter_address.hpp. `refused` when another daemon has the exciter. Waits for
  // `patience` at most, and only as the service. Held until the object is destroyed. May start a
  // thread.
  static Result<std::unique_ptr<ExciterLock>> take(const std::string& address,
                                                   const LockPlace& place, LetGo let_go);
  virtual ~ExciterLock() = default;
  ExciterLock(const ExciterLock&) = delete;
  ExciterLock& operator=(const ExciterLock&) = delete;

 protected:
  ExciterLock() = default;
};

}  // namespace shaker::daemon
