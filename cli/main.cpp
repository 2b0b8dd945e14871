// shakerctl, the operator's program: the command line. The commands are in cli/commands/.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <functional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "cli/commands.hpp"
#include "cli/completion.hpp"
#include "cli/unknown_command.hpp"

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
4 the daemon refused; 5 the estimate is not usable.)";

struct Options {
  Common common;
  WatchOptions watch;
  RunOptions run;
  ProveOptions prove;
  EstimateOptions estimate;
  CompareOptions compare;
  DropOptions drop;
  ReproduceOptions reproduce;
  PlanCommand plan;
  MonteCarloCommand monte_carlo;
  ResponseOptions response;
  ExportOptions export_runs;
  DiagnoseCommandOptions diagnose;
  CampaignsOptions campaigns;
  ShowOptions show;
  CheckOptions check;
  std::function<int()> action;
};

CLI::App* add(CLI::App& app, Options& o, const char* name, const char* help,
              std::function<int()> action) {
  CLI::App* command = app.add_subcommand(name, help);
  command->add_flag("--json", o.common.json, "Print JSON instead of text");
  command->callback([&o, action = std::move(action)] { o.action = action; });
  return command;
}

void add_socket(CLI::App* command, Options& o) {
  command->add_option("--socket", o.common.socket, "Where the daemon listens")
      ->envname("SHAKERD_SOCKET")
      ->capture_default_str();
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
  running->add_option("campaign", o.run.campaign, "Campaign file")->required();
  running->add_flag("--quiet", o.run.quiet, "No bar, and no line for a cycle or an estimate");
  running->footer(
      "Takes control, starts, and keeps the lease: when this program ends or hangs, the\n"
      "daemon ramps down. Ctrl-C stops and waits for the ramp; a second one leaves.");
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
  add_socket(add(app, o, "stop", "Ramp down; anyone may", order_of("stop")), o);
  add_socket(
      add(app, o, "estop", "Zero at once, without a ramp; latches a fault", order_of("estop")), o);
  add_socket(add(app, o, "ack", "Acknowledge a fault whose cause is gone", order_of("ack")), o);
}

void add_input(CLI::App* command, InputOptions& o) {
  command->add_option("--model", o.model, "Model file (default: the database's own)");
  command->add_option("--frequency", o.frequency_hz, "Of the excitation, Hz (CSV)");
  command->add_option("--amplitude", o.amplitude,
                      "Of the table's acceleration, m/s^2 (CSV without an excitation column)");
}

void add_bias(CLI::App* command, std::string& rule) {
  command
      ->add_option(
          "--bias", rule,
          "The bias that the model's bend gives the values: auto takes it off where it is 0.05 to "
          "0.25 standard errors, off leaves the plain optimum, always takes it off unless "
          "that crosses a bound")
      ->check(CLI::IsMember({"auto", "off", "always"}))
      ->capture_default_str();
}

void add_drop(CLI::App& app, Options& o) {
  auto* dropping = add(app, o, "drop", "Predict a drop test from an identified model",
                       [&o] { return drop(o.common, o.drop); });
  dropping->add_option("--sink-speed", o.drop.sink_speed, "At touch-down, m/s")->required();
  auto* campaign =
      dropping->add_option("--campaign", o.drop.campaign, "Campaign database to identify from");
  dropping->add_option("--model", o.drop.model, "Model file (default: the campaign's own)");
  dropping->add_option("--estimate", o.drop.estimate, "What `estimate --json` printed")
      ->excludes(campaign);
  dropping->add_option("--lift", o.drop.lift, "Of the wing, share of the weight, 0 to 1");
  dropping->add_option("--mass", o.drop.mass, "Falling mass in kg: loads in N, energy in J")
      ->check(CLI::PositiveNumber);
  dropping->add_option("--duration", o.drop.duration, "s")->capture_default_str();
  dropping->add_option("--samples", o.drop.samples, "Of the sampled band")->capture_default_str();
  dropping->add_option("--identified-speed", o.drop.identified_speed,
                       "Largest speed at which the model was identified, m/s");
  dropping->add_option("--identified-stroke", o.drop.identified_stroke,
                       "Largest stroke at which the model was identified, m");
  dropping->add_option("--truth", o.drop.truth, "Model file whose starts are the truth: compare");
  dropping->add_option("--svg", o.drop.svg, "Draw the load into this file");
  dropping->footer("The band is that of the parameters; it knows no effect that the model lacks.");
}

void add_response(CLI::App& app, Options& o) {
  auto* responding = add(app, o, "response", "Response curve of a model, through folds",
                         [&o] { return response(o.common, o.response); });
  responding->add_option("model", o.response.model, "Model file; its starts are the parameters")
      ->required();
  const auto positive = CLI::PositiveNumber;
  responding->add_option("--amplitude", o.response.amplitude, "Of the table's acceleration")
      ->check(positive);
  responding->add_option("--from", o.response.from, "Frequency, Hz")->check(positive);
  responding->add_option("--to", o.response.to, "Frequency, Hz")->check(positive);
  responding
      ->add_option("--at", o.response.frequency_hz, "Over the amplitude at this frequency, Hz")
      ->check(positive);
  responding->add_option("--amplitudes", o.response.amplitudes, "A1,A2: from and to")
      ->delimiter(',')
      ->expected(2)
      ->check(positive);
  responding->add_option("--svg", o.response.svg, "Write a picture to this file");
}

void add_offline(CLI::App& app, Options& o) {
  auto* estimating =
      add(app, o, "estimate", "Estimate from a campaign database or a CSV file", [&o] {
        return o.estimate.transient ? estimate_transient(o.common, o.estimate)
                                    : estimate(o.common, o.estimate);
      });
  estimating->add_option("file", o.estimate.file, "FILE.db, or FILE.csv with a header row")
      ->required();
  add_input(estimating, o.estimate);
  auto* periods =
      estimating
          ->add_option(
              "--periods", o.estimate.periods,
              "The response repeats only after so many periods of the excitation, 2 or 3: M, "
              "or RUN=M for one run of a database")
          ->delimiter(',')
          ->expected(1, CLI::detail::expected_max_vector_size)
          ->allow_extra_args(false);
  estimating
      ->add_option("--starts", o.estimate.starts,
                   "From so many starts spread over the parameters' bounds; tells the minima apart")
      ->check(CLI::Range(1, 1000));
  estimating->add_option("--seed", o.estimate.seed, "Of the spread of starts")
      ->capture_default_str();
  auto* accuracy =
      estimating
          ->add_option("--accuracy", o.estimate.accuracy,
                       "Refine the grid until it changes no parameter by more, e.g. 1e-9; 1e-4 by "
                       "itself where the model states how friction turns round (e)")
          ->check(CLI::Range(1e-12, 1e-2));
  auto* transient = estimating->add_flag("--transient", o.estimate.transient,
                                         "The record is not periodic: integrate it in time");
  transient->excludes(accuracy)->excludes(periods);
  estimating
      ->add_option("--initial", o.estimate.initial,
                   "Known initial states, e.g. 0,3: stroke, speed (default: estimated)")
      ->delimiter(',')
      ->needs(transient);
  estimating->add_option("--integrator", o.estimate.integrator, "adams, bdf or rk4")
      ->check(CLI::IsMember({"adams", "bdf", "rk4"}))
      ->needs(transient);
  estimating
      ->add_option("--intervals", o.estimate.intervals,
                   "linear, profile (follows the likelihood), bootstrap or posterior (by sampling)")
      ->check(CLI::IsMember({"linear", "profile", "bootstrap", "posterior"}))
      ->capture_default_str();
  estimating
      ->add_option("--loss", o.estimate.loss, "squared; or huber, cauchy, tukey against outliers")
      ->check(CLI::IsMember({"squared", "huber", "cauchy", "tukey"}))
      ->capture_default_str();
  estimating
      ->add_option(
          "--objective", o.estimate.objective,
          "least_squares, weighted, maximum_likelihood, joint_covariance, harmonics or map "
          "(default: least squares, with the model's priors if it has some)")
      ->check(CLI::IsMember({"least_squares", "weighted", "maximum_likelihood", "joint_covariance",
                             "harmonics", "map"}));
  estimating
      ->add_option("--channels", o.estimate.channels,
                   "displacement, acceleration, force: those to be fitted together")
      ->check(CLI::IsMember({"displacement", "acceleration", "force"}))
      ->delimiter(',');
  estimating
      ->add_option("--noise", o.estimate.noise,
                   "Known standard deviation of each channel's noise, in the file's units")
      ->check(CLI::PositiveNumber)
      ->delimiter(',');
  estimating->add_option("--mass", o.estimate.mass, "That the load cell carries, kg")
      ->check(CLI::PositiveNumber);
  estimating->add_flag("--stagewise", o.estimate.stagewise,
                       "Parameters and noise covariance in turn instead of together");
  add_bias(estimating, o.estimate.bias);
  estimating->footer(
      "CSV columns: t,y (the excitation is then amplitude cos(2 pi frequency t)), or\n"
      "t,excitation,displacement. t in seconds; any number of periods. With --channels also\n"
      "acceleration (of the sprung mass, m/s^2) and force (load cell, N).\n"
      "With --transient: t,excitation,displacement or t,displacement (drop, free decay).");
  auto* comparing = add(app, o, "compare", "What each optimiser needs and finds on one data set",
                        [&o] { return compare(o.common, o.compare); });
  auto* compared = comparing->add_option("file", o.compare.file, "FILE.db or FILE.csv");
  add_input(comparing, o.compare);
  comparing->add_option("--figure", o.compare.figure, "The paper's data instead: 11, 12, 13 or 14")
      ->excludes(compared);
  comparing->add_option("--start", o.compare.start, "Free parameters, separated by commas")
      ->delimiter(',');
  comparing->add_option("--method", o.compare.methods, "Only this one; may be given again");
  add_response(app, o);
  auto* reproducing =
      add(app, o, "reproduce", "The paper's figures 5 to 14 again, beside the print",
          [&o] { return reproduce(o.common, o.reproduce); });
  auto* figure =
      reproducing->add_option("--figure", o.reproduce.figure, "5, 6, 7, 9 to 14 (default: all)");
  reproducing->add_flag("--bias", o.reproduce.bias, "Show what the paper's test hides")
      ->excludes(figure);
  auto* diagnosing =
      add(app, o, "diagnose", "What does the model lack? Name it, add it, show the gap",
          [&o] { return diagnose(o.common, o.diagnose); });
  diagnosing->add_option("campaign", o.diagnose.campaign, "Folder with campaign.json, or FILE.db");
  diagnosing->add_option("--model", o.diagnose.model, "Model file to start from");
  diagnosing
      ->add_option("--out", o.diagnose.out,
                   "Folder for diagnosis.json, the improved model.json and report.html")
      ->type_name(kFolderType);
  diagnosing->add_flag(
      "--daemon", o.diagnose.daemon,
      "Let the daemon do it, on a campaign of its own: CAMPAIGN is then a name\n"
      "(default: the newest), --model defaults to the campaign's, and --out names\n"
      "a folder beside the campaign");
  diagnosing->add_flag("--job", o.diagnose.job, "For the daemon")->group("");
  add_socket(diagnosing, o);
  diagnosing
      ->add_option("--false-alarm-rate", o.diagnose.false_alarm_rate,
                   "How often something is named though nothing is missing")
      ->check(CLI::Range(1e-6, 0.5))
      ->capture_default_str();
  diagnosing->add_flag("--thorough", o.diagnose.thorough,
                       "Go on as long as there is more to try, not just for some two seconds");
  add_drop(app, o);
  auto* exporting = add(app, o, "export", "Write a campaign database as CSV, MAT or UFF",
                        [&o] { return export_runs(o.common, o.export_runs); });
  exporting->add_option("database", o.export_runs.database, "Campaign database")->required();
  exporting->add_option("--directory", o.export_runs.directory, "Where to")
      ->type_name(kFolderType)
      ->capture_default_str();
  exporting
      ->add_option("--format", o.export_runs.format, "csv, mat (MATLAB 7.3), uff (data sets 58)")
      ->check(CLI::IsMember({"csv", "mat", "uff"}))
      ->capture_default_str();
  exporting->add_flag("--samples", o.export_runs.samples, "Raw samples instead of cycles");
  exporting->add_flag("--all", o.export_runs.all, "Also cycles that were not accepted");
  auto* listing = add(app, o, "campaigns", "List the campaigns of a directory, the newest last",
                      [&o] { return campaigns(o.common, o.campaigns); });
  listing->add_option("directory", o.campaigns.directory, "Of campaign databases")
      ->type_name(kFolderType)
      ->capture_default_str();
  auto* showing = add(app, o, "show", "What a campaign database holds, and its last estimate",
                      [&o] { return show(o.common, o.show); });
  showing->add_option("file", o.show.file, "Campaign database")->required();
  auto* checking = add(app, o, "check", "Is a rig, model or campaign file good?",
                       [&o] { return check(o.common, o.check); });
  checking->add_option("file", o.check.file, "The file")->required();
  checking->add_option("--rig", o.check.rig, "Rig file whose limits a campaign is held against");
}

void add_worth(CLI::App& app, Options& o) {
  auto* planning = add(app, o, "plan", "Which runs will determine the parameters best",
                       [&o] { return plan(o.common, o.plan); });
  planning->add_option("model", o.plan.model, "Model file; its starts are where it is looked at")
      ->required();
  planning->add_option("--rig", o.plan.rig, "Rig file, for its limits");
  planning->add_option("--frequencies", o.plan.frequencies_hz, "To choose from, Hz");
  planning->add_option("--amplitudes", o.plan.amplitudes, "To choose from, of the acceleration");
  planning->add_option("--runs", o.plan.runs, "Largest set")
      ->check(CLI::Range(1, 12))
      ->capture_default_str();
  planning->add_option("--noise", o.plan.noise, "Standard deviation of one sample")
      ->check(CLI::PositiveNumber);
  planning->add_option("--points", o.plan.points, "Samples a period")
      ->check(CLI::Range(8, 4096))
      ->capture_default_str();
  planning->add_option("--cycles", o.plan.cycles, "Periods in a run")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  planning->add_option("--threads", o.plan.threads, "0: all")->check(CLI::Range(0U, 256U));
  planning->add_option("--draw", o.plan.draw, "Write a page (HTML) with pictures there");
  auto* repeating =
      add(app, o, "monte-carlo", "Estimate made-up campaigns many times: bias, scatter, coverage",
          [&o] { return monte_carlo(o.common, o.monte_carlo); });
  auto& m = o.monte_carlo;
  auto* model = repeating->add_option("model", m.model, "Model file; its starts are the truth");
  repeating->add_option("--figure", m.figure, "The paper's experiment 11, 12, 13 or 14 instead")
      ->excludes(model);
  repeating->add_option("--frequency", m.frequencies_hz, "Of each run, Hz");
  repeating->add_option("--amplitude", m.amplitudes, "Of each run, or one for all");
  repeating->add_option("--noise", m.noise, "Standard deviation of one sample");
  repeating->add_flag("--uniform", m.uniform, "Uniform noise instead of normal");
  repeating->add_option("--points", m.points, "Samples a period")
      ->check(CLI::Range(8, 4096))
      ->capture_default_str();
  repeating->add_option("--cycles", m.cycles, "Periods averaged in a run")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  repeating->add_option("--replications", m.replications, "How often")
      ->check(CLI::Range(2L, 10000000L))
      ->capture_default_str();
  repeating->add_option("--seed", m.seed, "Of the noise")->capture_default_str();
  repeating->add_option("--threads", m.threads, "0: all; the figures are the same for any number")
      ->check(CLI::Range(0U, 256U))
      ->capture_default_str();
  repeating->add_flag("--profile", m.profile, "Profile-likelihood intervals, too");
  add_bias(repeating, m.bias);
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
  add_offline(app, options);
  add_worth(app, options);
  add_completion(app, options.action);
  if (argc > 1 && argv[1][0] != '-' && argv[1][0] != '\0') {
    std::vector<std::string> known;
    for (const CLI::App* command : app.get_subcommands([](CLI::App*) { return true; }))
      known.push_back(command->get_name());
    if (std::ranges::find(known, std::string(argv[1])) == known.end()) {
      return fail(options.common, kBadInput, unknown_command(argv[1], std::move(known)));
    }
  }
  try {
    app.parse(argc, argv);
    return options.action();
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kOk : kBadInput;
  } catch (const std::exception& error) {
    return fail(options.common, kNegative, fmt::format("unexpected: {}", error.what()));
  }
}
