// The process. This thread, an sd-event loop, serves the clients: it parses what they send and
// gives them what the recorder has committed. The engine has a thread of its own (RigThread), as
// have the devices, the recorder, the estimator and the diagnosis.
#pragma once

#include <memory>
#include <vector>

#include "base/clock.hpp"
#include "config/rig.hpp"
#include "daemon/service/options.hpp"
#include "drivers/factory.hpp"

namespace shaker::daemon {

class Service {
 public:
  // Opens sockets, starts the threads and says what an earlier daemon left behind. An Error is
  // about the sockets. The caller holds the rig's lock; `clock` outlives the service.
  static Result<std::unique_ptr<Service>> make(const Options& options, const config::RigConfig& rig,
                                               drivers::Devices devices, Clock& clock);
  ~Service();

  // SIGTERM and SIGINT come to the loop. To be called before any thread is started (the log's too):
  // a thread that does not inherit the mask would die of them, and the process with it, unramped.
  static void block_signals();

  // Until SIGTERM or SIGINT; then ramps down. Returns the exit status.
  int run();

 private:
  struct Parts;
  explicit Service(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace shaker::daemon
