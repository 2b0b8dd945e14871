// shakerd-stop-exciter: stops the exciter of a rig, in whatever state the daemon ended.
//
// systemd runs it after every end of the daemon (ExecStopPost=), so it needs nothing from the
// daemon. Of the rig file it needs the exciter only. It prefers the copy that the daemon has
// kept (--used), because the file may have been edited while the daemon ran. It does nothing
// after a daemon that was refused the exciter (--unless-status), because another daemon is
// using it. It writes amplitude zero and "disabled", reads them back, and tries again for a few
// seconds. Exit status 0: the exciter is stopped. 1: this is not certain; a message gives the
// reason.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "config/rig.hpp"
#include "drivers/factory.hpp"

namespace {

using namespace std::chrono_literals;

int say(const std::string& sentence) {
  fmt::print(stderr, "shakerd-stop-exciter: {}\n", sentence);
  return 1;
}

// True if systemd reports that the daemon ended with this status (systemd.exec, ExecStopPost=).
bool ended_with(int status) {
  const char* code = std::getenv("EXIT_CODE");
  const char* text = std::getenv("EXIT_STATUS");
  return code && text && code == std::string("exited") && text == std::to_string(status);
}

using Rig = shaker::Result<shaker::config::RigConfig>;

// Relative paths in the copy start at the folder of the original file.
Rig load(const std::filesystem::path& file, const std::filesystem::path& used) {
  if (!used.empty()) {
    if (Rig rig = shaker::config::load_rig(used)) {
      rig->directory = file.parent_path();
      return rig;
    }
  }
  return shaker::config::load_rig(file);
}

int stop(const std::filesystem::path& file, const std::filesystem::path& used, double patience_s) {
  const Rig rig = load(file, used);
  if (!rig) return say(rig.error().what);
  shaker::RealClock clock;
  const auto exciter = shaker::drivers::make_exciter(*rig, clock);
  if (!exciter) return say(fmt::format("{}: {}", file.string(), exciter.error().what));
  const shaker::Nanoseconds latest = clock.now() + shaker::from_seconds(patience_s);
  for (;;) {
    const shaker::Result<void> stopped = (*exciter)->stop();
    if (stopped) return 0;
    if (clock.now() >= latest) {
      return say(fmt::format("the exciter may still be running: {}. Use the rig's own stop",
                             stopped.error().what));
    }
    clock.sleep_until(clock.now() + 100ms);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Stops the exciter of a rig at once: amplitude zero and disabled."};
  std::string file, used;
  double patience_s = 5.0;
  app.add_option("rig", file, "the rig file, e.g. /etc/shakerd/rig.json")->required();
  app.add_option("--used", used,
                 "the copy of the rig file that the daemon has kept; where it is there and good, "
                 "the exciter in it is stopped");
  app.add_option("--for", patience_s, "keep trying for so many seconds")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 60.0));
  std::optional<int> unless;
  app.add_option("--unless-status", unless,
                 "do nothing when systemd says that the daemon ended with this exit status");
  app.footer("Exit status: 0 the exciter is stopped; 1 it is not known to be, with the reason.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& wrong) {
    return app.exit(wrong) == 0 ? 0 : 1;
  }
  if (unless && ended_with(*unless)) return 0;
  return stop(file, used, patience_s);
}
