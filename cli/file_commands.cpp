// The commands that work on files, with their options.
#include "cli/command_line.hpp"
#include "cli/completion.hpp"

namespace shaker::cli {
namespace {

void add_input(CLI::App* command, InputOptions& o) {
  command->add_option("--model", o.model, "Model file (default: the database's own)");
  command->add_option("--frequency", o.frequency_hz, "Frequency of the excitation, Hz (CSV)");
  command->add_option(
      "--amplitude", o.amplitude,
      "Amplitude of the table's acceleration, m/s^2 (CSV without an excitation column)");
}

void add_bias(CLI::App* command, std::string& rule) {
  command
      ->add_option(
          "--bias", rule,
          "Bias of the values from the curvature of the model: auto removes it if it is 0.05 to "
          "0.25 standard errors, off keeps the plain optimum, always removes it unless "
          "that crosses a bound")
      ->check(CLI::IsMember({"auto", "off", "always"}))
      ->capture_default_str();
}

void add_response(CLI::App& app, Options& o) {
  auto* responding = add(app, o, "response", "Response curve of a model, through folds",
                         [&o] { return response(o.common, o.response); });
  responding
      ->add_option("model", o.response.model, "Model file; its start values are the parameters")
      ->required();
  const auto positive = CLI::PositiveNumber;
  responding
      ->add_option("--amplitude", o.response.amplitude, "Amplitude of the table's acceleration")
      ->check(positive);
  responding->add_option("--from", o.response.from, "Frequency, Hz")->check(positive);
  responding->add_option("--to", o.response.to, "Frequency, Hz")->check(positive);
  responding
      ->add_option("--at", o.response.frequency_hz,
                   "Response over the amplitude at this frequency, Hz")
      ->check(positive);
  responding->add_option("--amplitudes", o.response.amplitudes, "A1,A2: from and to")
      ->delimiter(',')
      ->expected(2)
      ->check(positive);
  responding->add_option("--svg", o.response.svg, "Write a picture to this file");
}

// How the residuals of an estimate are weighed.
void add_weighing(CLI::App* command, EstimateOptions& o) {
  command
      ->add_option("--intervals", o.intervals,
                   "linear, profile (follows the likelihood), bootstrap or posterior (by sampling)")
      ->check(CLI::IsMember({"linear", "profile", "bootstrap", "posterior"}))
      ->capture_default_str();
  command->add_option("--loss", o.loss, "squared; or huber, cauchy, tukey against outliers")
      ->check(CLI::IsMember({"squared", "huber", "cauchy", "tukey"}))
      ->capture_default_str();
  command
      ->add_option(
          "--objective", o.objective,
          "least_squares, weighted, maximum_likelihood, joint_covariance, harmonics or map "
          "(default: least squares, with the model's priors if it has some)")
      ->check(CLI::IsMember({"least_squares", "weighted", "maximum_likelihood", "joint_covariance",
                             "harmonics", "map"}));
  command
      ->add_option("--channels", o.channels,
                   "displacement, acceleration, force: those to be fitted together")
      ->check(CLI::IsMember({"displacement", "acceleration", "force"}))
      ->delimiter(',');
  command
      ->add_option("--noise", o.noise,
                   "Known standard deviation of each channel's noise, in the file's units")
      ->check(CLI::PositiveNumber)
      ->delimiter(',');
  command->add_option("--mass", o.mass, "Mass on the load cell, kg")->check(CLI::PositiveNumber);
  command->add_flag("--stagewise", o.stagewise,
                    "Parameters and noise covariance in turn instead of together");
}

void add_estimate(CLI::App& app, Options& o) {
  auto* estimating = add(app, o, "estimate", "Estimate from campaigns or from a CSV file", [&o] {
    return o.estimate.transient ? estimate_transient(o.common, o.estimate)
                                : estimate(o.common, o.estimate);
  });
  estimating
      ->add_option("campaign", o.estimate.files,
                   "Campaigns of one damper (FILE.db, or a folder with campaign.json), or one "
                   "FILE.csv with a header row")
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
  estimating->add_option("--seed", o.estimate.seed, "Seed of the random start values")
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
  estimating->add_option("--integrator", o.estimate.integrator, "adams, bdf, rk4 or sdirk4")
      ->check(CLI::IsMember({"adams", "bdf", "rk4", "sdirk4"}))
      ->needs(transient);
  add_weighing(estimating, o.estimate);
  add_bias(estimating, o.estimate.bias);
  estimating->footer(
      "CSV columns: t,y (the excitation is then amplitude cos(2 pi frequency t)), or\n"
      "t,excitation,displacement. t in seconds; any number of periods. With --channels also\n"
      "acceleration (of the sprung mass, m/s^2) and force (load cell, N).\n"
      "With --transient: t,excitation,displacement or t,displacement (drop, free decay).");
}

void add_compare(CLI::App& app, Options& o) {
  auto* comparing = add(app, o, "compare", "What each optimiser needs and finds on one data set",
                        [&o] { return compare(o.common, o.compare); });
  auto* compared = comparing->add_option("campaign", o.compare.files,
                                         "Campaigns (FILE.db, or a folder), or one FILE.csv");
  add_input(comparing, o.compare);
  comparing->add_option("--figure", o.compare.figure, "The paper's data instead: 11, 12, 13 or 14")
      ->excludes(compared);
  comparing->add_option("--start", o.compare.start, "Free parameters, separated by commas")
      ->delimiter(',');
  comparing->add_option("--method", o.compare.methods, "Only this one; may be given again");
}

void add_reproduce(CLI::App& app, Options& o) {
  auto* reproducing =
      add(app, o, "reproduce", "The paper's figures 5 to 14 again, beside the print",
          [&o] { return reproduce(o.common, o.reproduce); });
  auto* figure =
      reproducing->add_option("--figure", o.reproduce.figure, "5, 6, 7, 9 to 14 (default: all)");
  reproducing->add_flag("--bias", o.reproduce.bias, "Show what the paper's test hides")
      ->excludes(figure);
}

void add_diagnose(CLI::App& app, Options& o) {
  auto* diagnosing =
      add(app, o, "diagnose", "What does the model lack? Name it, add it, show the gap",
          [&o] { return diagnose(o.common, o.diagnose); });
  diagnosing->add_option("campaign", o.diagnose.campaigns,
                         "Campaigns of one damper: folders with campaign.json, or FILE.db");
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
}

void add_export(CLI::App& app, Options& o) {
  auto* exporting = add(app, o, "export", "Write a campaign as CSV, MAT or UFF",
                        [&o] { return export_runs(o.common, o.export_runs); });
  exporting
      ->add_option("campaign", o.export_runs.campaign, "FILE.db, or a folder with campaign.json")
      ->required();
  exporting->add_option("--directory", o.export_runs.directory, "Where to")
      ->type_name(kFolderType)
      ->capture_default_str();
  exporting
      ->add_option("--format", o.export_runs.format, "csv, mat (MATLAB 7.3), uff (data sets 58)")
      ->check(CLI::IsMember({"csv", "mat", "uff"}))
      ->capture_default_str();
  exporting->add_flag("--samples", o.export_runs.samples, "Raw samples instead of cycles");
  exporting->add_flag("--all", o.export_runs.all, "Also cycles that were not accepted");
}

void add_import(CLI::App& app, Options& o) {
  auto& i = o.import_campaign;
  auto* importing = add(app, o, "import", "Make a campaign's folder of CSV, MAT or UFF files",
                        [&o] { return import_campaign(o.common, o.import_campaign); });
  importing->add_option("source", i.source, "Folder of CSV files; or FILE.csv, .mat, .uff, .unv")
      ->required();
  importing->add_option("--out", i.out, "The campaign's folder: a new one")
      ->type_name(kFolderType)
      ->required();
  importing->add_option("--unit", i.units,
                        "CHANNEL=UNIT, where the file states none: t, displacement, excitation, "
                        "acceleration, force");
  importing->add_option("--column", i.columns,
                        "CHANNEL=NAME, where the file calls a channel otherwise");
  importing->add_option("--frequency", i.frequencies_hz, "Frequency of all runs, or of each, Hz")
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
  importing
      ->add_option("--amplitude", i.amplitudes,
                   "Amplitude of the table's acceleration, m/s^2: of all runs, or of each")
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
  importing->add_option("--kind", i.kind, "Kind of all runs (default: by their channels)")
      ->check(CLI::IsMember({"periodic", "imposed_motion", "transient"}));
  importing->add_option("--reference-mass", i.reference_mass, "Mass on the load cell, kg")
      ->check(CLI::PositiveNumber);
}

void add_push(CLI::App& app, Options& o) {
  auto* pushing = add(app, o, "push", "Copy campaigns into the tables of a PostgreSQL server",
                      [&o] { return push(o.common, o.push); });
  pushing->add_option("campaigns", o.push.campaigns, "FILE.db, or folders of them")
      ->capture_default_str();
  pushing
      ->add_option("--to", o.push.to,
                   "Connection string or address (default: PGHOST, PGDATABASE, ... of libpq); the "
                   "password belongs into ~/.pgpass")
      ->type_name("CONNECTION");
  pushing->add_option("--schema", o.push.schema, "Schema of the tables")->capture_default_str();
  pushing
      ->add_option("--patience", o.push.patience_s,
                   "Longest time without an answer of the server, s")
      ->check(CLI::Range(1.0, 3600.0))
      ->capture_default_str();
  pushing->add_flag("--print-schema", o.push.print_schema,
                    "Print the SQL that makes the tables, and do nothing else");
}

void add_campaigns(CLI::App& app, Options& o) {
  auto* listing = add(app, o, "campaigns", "List the campaigns of a directory, the newest last",
                      [&o] { return campaigns(o.common, o.campaigns); });
  listing->add_option("directory", o.campaigns.directory, "Folder of campaign databases")
      ->type_name(kFolderType)
      ->capture_default_str();
  auto* showing =
      add(app, o, "show", "What a campaign database holds, where it comes from, its last estimate",
          [&o] { return show(o.common, o.show); });
  showing->add_option("file", o.show.file, "Campaign database")->required();
  auto* noting = add(app, o, "note", "Add a note to a campaign database, with date and user",
                     [&o] { return note(o.common, o.note); });
  noting->add_option("file", o.note.file, "Campaign database")->required();
  noting->add_option("text", o.note.text, "The note, in quotes")->required();
  auto* checking = add(app, o, "check", "Is a rig, model or campaign file good?",
                       [&o] { return check(o.common, o.check); });
  checking->add_option("file", o.check.file, "The file")->required();
  checking->add_option("--rig", o.check.rig, "Rig file whose limits a campaign is held against");
}

void add_verify(CLI::App& app, Options& o) {
  auto* verifying = add(app, o, "verify", "Is a campaign as it was recorded, to the last byte?",
                        [&o] { return verify(o.common, o.verify); });
  verifying->add_option("campaigns", o.verify.campaigns, "FILE.db, or folders with campaign.json")
      ->required();
  auto* seal = verifying->add_flag("--seal", o.verify.seal,
                                   "If everything fits, write the SHA-256 of every file beside it");
  verifying
      ->add_option("--sha256", o.verify.sha256,
                   "SHA-256 of the only campaign, as a report states it")
      ->check(CLI::Validator(
          [](std::string& text) {
            const bool good = text.size() == 64 &&
                              text.find_first_not_of("0123456789abcdef") == std::string::npos;
            return good ? std::string() : std::string("is not 64 hexadecimal digits");
          },
          "HEX"))
      ->excludes(seal);
}

void add_plan(CLI::App& app, Options& o) {
  auto* planning = add(app, o, "plan", "Which runs will determine the parameters best",
                       [&o] { return plan(o.common, o.plan); });
  planning
      ->add_option("model", o.plan.model, "Model file; the runs are planned for its start values")
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
  planning
      ->add_option("--for", o.plan.aim,
                   "all (the volume), drop (its peak load), or the name of a parameter")
      ->capture_default_str();
  planning->add_option("--sink-speed", o.plan.sink_speed, "Sink speed of the drop, m/s")
      ->check(CLI::PositiveNumber);
  planning->add_option("--lift", o.plan.lift, "Lift in the drop, share of the weight")
      ->check(CLI::Range(0.0, 1.0));
  planning
      ->add_option("--prior-spread", o.plan.prior_spread,
                   "Relative standard deviation of a parameter whose model states no prior")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  planning
      ->add_option("--minutes", o.plan.minutes,
                   "Rig time of every set, settling included, in place of --cycles")
      ->check(CLI::PositiveNumber);
  planning->add_option("--threads", o.plan.threads, "0: all")->check(CLI::Range(0U, 256U));
  planning->add_option("--draw", o.plan.draw, "Write a page (HTML) with pictures there");
  planning->add_option("--write", o.plan.write,
                       "Write the best set as a campaign file there, for `shakerctl run`");
}

void add_monte_carlo(CLI::App& app, Options& o) {
  auto* repeating =
      add(app, o, "monte-carlo", "Estimate made-up campaigns many times: bias, scatter, coverage",
          [&o] { return monte_carlo(o.common, o.monte_carlo); });
  auto& m = o.monte_carlo;
  auto* model = repeating->add_option("model", m.model, "Model file; its starts are the truth");
  repeating->add_option("--figure", m.figure, "The paper's experiment 11, 12, 13 or 14 instead")
      ->excludes(model);
  repeating->add_option("--frequency", m.frequencies_hz, "Frequency of each run, Hz");
  repeating->add_option("--amplitude", m.amplitudes, "Amplitude of each run, or one for all");
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
  repeating->add_option("--seed", m.seed, "Seed of the noise")->capture_default_str();
  repeating->add_option("--threads", m.threads, "0: all; the figures are the same for any number")
      ->check(CLI::Range(0U, 256U))
      ->capture_default_str();
  repeating->add_flag("--profile", m.profile, "Profile-likelihood intervals, too");
  add_bias(repeating, m.bias);
  auto* keep =
      repeating->add_option("--keep", m.keep, "Write a line of JSON for each into this file");
  repeating->add_option("--shard", m.shard, "Only this part: 3/7 is the third of seven")
      ->needs(keep);
  repeating
      ->add_option("--merge", m.merge, "The result of files that parts with these options kept")
      ->excludes(keep);
}

}  // namespace

void add_file_commands(CLI::App& app, Options& o) {
  add_estimate(app, o);
  add_compare(app, o);
  add_response(app, o);
  add_reproduce(app, o);
  add_diagnose(app, o);
  add_drop_commands(app, o);
  add_export(app, o);
  add_import(app, o);
  add_push(app, o);
  add_campaigns(app, o);
  add_verify(app, o);
  add_plan(app, o);
  add_monte_carlo(app, o);
}

}  // namespace shaker::cli
