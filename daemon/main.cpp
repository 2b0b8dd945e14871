// shakerd: see daemon/service/options.cpp for what it is told, daemon/service/service.cpp for what
// it does.
#include <exception>

#include <fmt/format.h>

#include "base/clock.hpp"
#include "config/rig.hpp"
#include "daemon/service/logging.hpp"
#include "daemon/service/options.hpp"
#include "daemon/service/rig_lock.hpp"
#include "daemon/service/service.hpp"
#include "drivers/factory.hpp"

namespace shaker::daemon {
namespace {

int complain(const Error& error, int status) {
  fmt::print(stderr, "shakerd: {}\n", error.what);
  return status;
}

int describe(const config::RigConfig& rig, const drivers::Devices& devices,
             const Options& options) {
  fmt::print("{}: good. Rig \"{}\".\n  exciter: {}\n", options.rig.string(), rig.name,
             devices.exciter->description());
  for (const auto& sensor : devices.sensors)
    fmt::print("  sensor: {}\n", sensor->description());
  return kGood;
}

int run(const Options& options) {
  RealClock clock;
  const auto rig = config::load_rig(options.rig);
  if (!rig) return complain(rig.error(), kBadInput);
  auto devices = drivers::make_devices(*rig, clock);
  if (!devices) return complain(devices.error(), kBadInput);
  if (options.check) return describe(*rig, *devices, options);

  const auto lock = RigLock::take(options.rig, options.data);
  if (!lock) return complain(lock.error(), kTrouble);
  Service::block_signals();
  const Logging logging;
  auto service = Service::make(options, *rig, std::move(*devices), clock);
  if (!service) return complain(service.error(), kTrouble);
  return (*service)->run();
}

}  // namespace
}  // namespace shaker::daemon

int main(int argc, char** argv) {
  using namespace shaker::daemon;
  const auto parsed = parse_options(argc, argv);
  if (const int* status = std::get_if<int>(&parsed)) return *status;
  try {
    return run(std::get<Options>(parsed));
  } catch (const std::exception& trouble) {
    fmt::print(stderr, "shakerd: {}\n", trouble.what());
    return kTrouble;
  }
}
