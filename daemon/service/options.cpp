#include "daemon/service/options.hpp"

#include <CLI/CLI.hpp>

namespace shaker::daemon {

const char* program_version() {
  return SHAKER_VERSION;
}

std::variant<Options, int> parse_options(int argc, char** argv) {
  Options options;
  CLI::App app(
      "shakerd drives a shaker rig: it runs campaigns of harmonic dwells on a damper, watches the "
      "limits,\nrecords every sample, and publishes an estimate of the damper's parameters after "
      "every "
      "cycle.\nIt moves nothing until a client starts a campaign (shakerctl run CAMPAIGN.json).",
      "shakerd");
  app.set_version_flag("--version", std::string("shakerd ") + program_version());
  app.add_option("--rig", options.rig,
                 "Rig file (JSON): devices, limits, lease. Devices of kind \"simulated\" are a rig "
                 "inside the daemon, so that everything can be tried without hardware.")
      ->required()
      ->type_name("RIG.json");
  app.add_option(
         "--socket", options.socket,
         "Unix socket for clients, mode 0660, group shaker. Ignored when systemd hands one over.")
      ->type_name("PATH")
      ->capture_default_str();
  app.add_option("--data", options.data, "Directory of the campaign databases")
      ->type_name("DIR")
      ->capture_default_str();
  app.add_option("--view-socket", options.view_socket,
                 "A second Unix socket, mode 0660, group shaker-view, whose clients may listen but "
                 "not command")
      ->type_name("PATH");
  app.add_option(
         "--tcp", options.tcp,
         "Also let clients listen, but not command, on this port of 127.0.0.1 (0: any free one)")
      ->type_name("PORT")
      ->check(CLI::Range(0, 65535));
  app.add_flag("--check", options.check, "Read the rig file, say what is in it, and leave");
  app.footer(
      "Exit status: 0 stopped as asked, 1 trouble (socket, ...), 2 bad options or rig file,\n"
      "3 another shakerd has the exciter or the directory; nothing was sent.\n"
      "SIGTERM ramps down and leaves; a second one stops the exciter at once.\n"
      "Look at the stream with:  nc -U /run/shakerd/shakerd.sock | jq -c .");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kGood : kBadInput;
  }
  return options;
}

}  // namespace shaker::daemon
