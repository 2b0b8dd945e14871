#include "cli/serving_program.hpp"

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include <systemd/sd-daemon.h>

#include "base/ending_signals.hpp"

namespace shaker::cli {
namespace {

constexpr int kServed = 0, kServingTrouble = 1, kBadOptions = 2;

int say_why(const ServingProgram& program, const std::string& sentence, int status) {
  std::fputs((program.name + ": " + sentence + "\n").c_str(), stderr);
  return status;
}

int served(const ServingProgram& program, DaemonLinks& links, int ending) {
  try {
    const auto outcome = program.serve(links, ending);
    ::sd_notify(0, "STOPPING=1");
    return outcome ? kServed : say_why(program, outcome.error().what, kServingTrouble);
  } catch (const std::exception& trouble) {
    return say_why(program, trouble.what(), kServingTrouble);
  }
}

// Threads that wait for a greeting, a name look-up or a connection cannot be called off, and nothing
// of theirs is needed any more: the process ends without waiting for them.
[[noreturn]] void serve_and_end(const ServingProgram& program,
                                const std::filesystem::path& socket) {
  const UniqueFd ending = ending_signals();
  ::signal(SIGPIPE, SIG_IGN);
  DaemonLinks links(socket, program.reader, program.documents);
  std::_Exit(served(program, links, ending.get()));
}

}  // namespace

int run_serving_program(const ServingProgram& program, int argc, char** argv) {
  std::filesystem::path socket = "/run/shakerd-view/view.sock";
  CLI::App app(program.about, program.name);
  app.set_version_flag("--version", program.name + " " + SHAKER_VERSION);
  app.add_option("--socket", socket,
                 "Unix socket of the daemon; best the one whose clients may only listen")
      ->type_name("PATH")
      ->capture_default_str();
  program.add_options(app);
  app.footer("Exit status: 0 stopped as asked, 1 trouble, 2 bad options.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kServed : kBadOptions;
  }
  try {
    if (program.check) {
      if (const auto good = program.check(); !good)
        return say_why(program, good.error().what, kBadOptions);
    }
    serve_and_end(program, socket);
  } catch (const std::exception& trouble) {
    return say_why(program, trouble.what(), kServingTrouble);
  }
}

}  // namespace shaker::cli
