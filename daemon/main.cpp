// shakerd, the daemon. daemon/service/options.cpp has its options, daemon/service/service.cpp
// its work.
#include <csignal>
#include <cstdio>
#include <exception>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "base/clock.hpp"
#include "config/json_tree.hpp"
#include "config/rig.hpp"
#include "daemon/service/logging.hpp"
#include "daemon/service/options.hpp"
#include "daemon/service/rig_lock.hpp"
#include "daemon/service/service.hpp"
#include "daemon/service/used_rig.hpp"
#include "drivers/factory.hpp"

namespace shaker::daemon {
namespace {

// Does not use fmt, which throws if the output is closed.
int complain(const std::string& sentence, int status) {
  std::fputs(("shakerd: " + sentence + "\n").c_str(), stderr);
  return status;
}

void end_gently() {
  ::kill(::getpid(), SIGTERM);
}

// Makes the daemon independent of its starter: no socket or database becomes its standard
// output, a closed reader of that output does not kill it, and a closed terminal ends it as
// SIGTERM does, with a ramp. A hang-up signal that the starter ignores (nohup) stays ignored.
void make_independent_of_the_starter() {
  for (int fd = STDIN_FILENO; fd <= STDERR_FILENO; ++fd) {
    if (::fcntl(fd, F_GETFD) < 0 && ::open("/dev/null", O_RDWR) != fd) std::terminate();
  }
  ::signal(SIGPIPE, SIG_IGN);
  struct sigaction hang_up {};
  ::sigaction(SIGHUP, nullptr, &hang_up);
  if (hang_up.sa_handler == SIG_IGN) return;
  hang_up.sa_handler = [](int) { end_gently(); };
  hang_up.sa_flags = SA_RESTART;
  ::sigaction(SIGHUP, &hang_up, nullptr);
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
  const auto text = config::read_text(options.rig);
  if (!text) return complain(text.error().what, kBadInput);
  auto rig = config::parse_rig(*text, options.rig.string());
  if (!rig) return complain(rig.error().what, kBadInput);
  rig->directory = options.rig.parent_path();
  auto devices = drivers::make_devices(*rig, clock);
  if (!devices) return complain(devices.error().what, kBadInput);
  if (options.check) return describe(*rig, *devices, options);

  Service::block_signals();  // the lock may start a thread
  const auto lock =
      RigLock::take(*rig, options.data, lock_place_of_this_process(), [](const std::string& who) {
        complain(fmt::format("The service, {}, wants the exciter: ramping down and ending.", who),
                 kGood);  // not in the log, which may have ended already
        end_gently();
      });
  if (!lock) {
    const bool taken = lock.error().kind == ErrorKind::refused;
    return complain(lock.error().what, taken ? kTaken : kTrouble);
  }
  const Logging logging;
  if (const auto kept = keep_used_rig(used_rig_file(), *text); !kept) {
    complain(kept.error().what, kGood);
  }
  auto service = Service::make(options, *rig, std::move(*devices), clock);
  if (!service) return complain(service.error().what, kTrouble);
  return (*service)->run();
}

}  // namespace
}  // namespace shaker::daemon

int main(int argc, char** argv) {
  using namespace shaker::daemon;
  make_independent_of_the_starter();
  const auto parsed = parse_options(argc, argv);
  if (const int* status = std::get_if<int>(&parsed)) return *status;
  try {
    return run(std::get<Options>(parsed));
  } catch (const std::exception& trouble) {
    return complain(trouble.what(), kTrouble);
  }
}
