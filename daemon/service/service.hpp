// The process. The calling thread runs an sd-event loop and serves the clients: it parses their
// requests and sends them the lines that the recorder has committed. The engine (RigThread),
// the devices, the recorder, the estimator and the diagnosis have threads of their own.
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
  // Opens sockets, starts the threads and begins to check the files of an earlier daemon.
  // Returns an Error for the sockets; throws std::system_error if the event loop cannot be set
  // up. The caller holds the rig's lock; `clock` outlives the service.
  static Result<std::unique_ptr<Service>> make(const Options& options, const config::RigConfig& rig,
                                               drivers::Devices devices, Clock& clock);
  ~Service();

  // Blocks SIGTERM and SIGINT, which the loop then receives. Call before any thread is started
  // (also that of the log): a thread without this mask would end the process without a ramp.
  static void block_signals();

  // Runs until SIGTERM or SIGINT, then ramps down. Returns the exit status.
  int run();

 private:
  struct Parts;
  explicit Service(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace shaker::daemon
