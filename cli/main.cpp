// shakerctl, the operator's program: the commands that need a daemon, and what starts a command.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "cli/command_line.hpp"
#include "cli/completion.hpp"
#include "cli/usage_error.hpp"

namespace {

using namespace shaker::cli;

constexpr const char* kFooter = R"(
Examples:
  shakerctl check rig.json                     is the file good, and what does it say?
  shakerctl run campaign-demo.json             run it, with a progress bar; Ctrl-C ramps down
  shakerctl watch                              look on while somebody else runs one
  shakerctl stop                               ramp down, whoever is in control
  shakerctl campaigns                          what has been measured
  shakerctl estimate demo_20260301T120000Z.db  the estimate again, from its database
  shakerctl diagnose campaign/ --model m.json  what does the model lack?

Exit status: 0 done; 1 done, but the outcome is bad; 2 usage or a bad file; 3 no daemon;
4 the daemon refused; 5 the estimate is not usable; 6 its intervals do not hold.)";

void add_proof(CLI::App& app, Options& o) {
  auto* proving = add(app, o, "prove-deadman",
                      "Prove in motion that the exciter comes to rest without its heartbeat",
                      [&o] { return prove_deadman(o.common, o.prove); });
  add_socket(proving, o);
  proving->add_option("--frequency", o.prove.frequency_hz, "Hz")->required();
  proving
      ->add_option("--amplitude", o.prove.amplitude,
                   "m/s^2, at most a tenth of the rig's excitation_max_m_s2")
      ->required();
  proving->footer(
      "For a drive whose heartbeat timeout cannot be read, and that does not trip at amplitude "
      "zero.\n"
      "The table moves gently, the heartbeat is withheld, and the table must come to rest within "
      "the\n"
      "rig file's deadman_max_s. The proof is kept with date and user until the rig file changes.");
}

void add_online(CLI::App& app, Options& o) {
  const auto order_of = [&o](const char* method) {
    return [&o, method] { return order(o.common, method); };
  };
  add_socket(add(app, o, "status", "What the rig does now, and the last estimate",
                 [&o] { return status(o.common); }),
             o);
  auto* watching =
      add(app, o, "watch", "Show what happens: a live table on a terminal, lines elsewhere",
          [&o] { return watch(o.common, o.watch); });
  add_socket(watching, o);
  watching->add_option("--seconds", o.watch.seconds, "End after so long (default: at Ctrl-C)")
      ->check(CLI::PositiveNumber);
  auto* running = add(app, o, "run", "Run a campaign and stay until the rig is at rest",
                      [&o] { return run(o.common, o.run); });
  add_socket(running, o);
  auto* campaign = running->add_option("campaign", o.run.campaign, "Campaign file");
  running
      ->add_option("--resume", o.run.resume,
                   "Measure the runs that these databases of a campaign lack, into a new one")
      ->check([](const std::string& word) {
        return word.starts_with("--") ? "is an option; name the databases behind --resume" : "";
      })
      ->excludes(campaign);
  running->add_option("--specimen", o.run.specimen,
                      "KEY=TEXT, kept with the measurement: name, serial, charge, oil, "
                      "temperature, notes");
  running->add_flag("--quiet", o.run.quiet, "No bar, and no line for a cycle or an estimate");
  running->footer(
      "Takes control, starts, and keeps the lease: when this program ends or hangs, the\n"
      "daemon ramps down. Ctrl-C stops and waits for the ramp; a second one leaves.\n"
      "On a terminal, p pauses and r resumes.");
  add_proof(app, o);
  add_socket(add(app, o, "stop", "Ramp down; anyone may", order_of("stop")), o);
  add_socket(add(app, o, "pause", "Ramp to rest and keep the campaign open; anyone may",
                 order_of("pause")),
             o);
  auto* resuming = add(app, o, "resume", "Take control of a paused campaign and go on with it",
                       [&o] { return resume(o.common); });
  add_socket(resuming, o);
  resuming->footer(
      "Where `shakerctl run` still has control, press r in its terminal (and p for a pause).");
  add_socket(
      add(app, o, "estop", "Zero at once, without a ramp; latches a fault", order_of("estop")), o);
  add_socket(add(app, o, "ack", "Acknowledge the alarms, and a fault whose cause is gone",
                 order_of("ack")),
             o);
}

// What the program was given. "help run" is "run --help", and "version" is "--version".
std::vector<std::string> words_of(int argc, char** argv) {
  std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  if (words.empty()) return words;
  if (words.front() == "help") {
    words.erase(words.begin());
    words.push_back("--help");
  } else if (words.front() == "version") {
    words.front() = "--version";
  }
  return words;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("The operator's hand: talks to shakerd, and estimates from files.", "shakerctl");
  Options options;
  app.set_version_flag("--version", "shakerctl " SHAKER_VERSION);
  app.footer(kFooter);
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  add_online(app, options);
  add_file_commands(app, options);
  add_completion(app, options.action);
  std::vector<std::string> words = words_of(argc, argv);
  if (!words.empty() && !words.front().empty() && words.front().front() != '-') {
    std::vector<std::string> known;
    for (const CLI::App* command : app.get_subcommands([](CLI::App*) { return true; }))
      known.push_back(command->get_name());
    if (std::ranges::find(known, words.front()) == known.end()) {
      return fail(options.common, kBadInput, unknown_command(words.front(), std::move(known)));
    }
  }
  try {
    std::ranges::reverse(words);  // as CLI11 wants them
    app.parse(std::move(words));
    return options.action();
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // help, version
    return fail(options.common, kBadInput, usage_error(error, app));
  } catch (const std::exception& error) {
    return fail(options.common, kNegative, fmt::format("unexpected: {}", error.what()));
  }
}
