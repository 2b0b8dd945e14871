// The commands of shakerctl: one function for each, in a file of its own in cli/commands/. A
// command writes results to stdout and an error, as one sentence, to stderr; with `json` also
// an object {"error": ...} to stdout. It returns an ExitCode. It is called once, from main(),
// which reports an exception as an unexpected failure.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/estimation_input.hpp"
#include "cli/exit_code.hpp"

namespace shaker::cli {

struct Common {
  bool json = false;
  std::filesystem::path socket = "/run/shakerd/shakerd.sock";
};

struct WatchOptions {
  double seconds = 0.0;  // 0: until Ctrl-C
};
struct RunOptions {
  std::filesystem::path campaign;             // empty with `resume`
  std::vector<std::filesystem::path> resume;  // databases whose missing runs are measured
  std::vector<std::string> specimen;          // KEY=TEXT, in place of those of the file
  bool quiet = false;                         // no bar, and no line for a cycle or an estimate
};
struct ProveOptions {
  double frequency_hz = 0.0, amplitude = 0.0;  // Hz, m/s^2
};
struct EstimateOptions : InputOptions {
  int starts = 1;  // above 1: see estimator/fit/several_starts.hpp
  unsigned seed = 1;
  double accuracy = 0.0;  // relative, of the parameters; 0: a fixed grid
  // For a record that is not periodic.
  bool transient = false;
  std::vector<double> initial;  // known initial states; empty: they are estimated
  std::string integrator;       // "adams", "bdf", "rk4", "sdirk4"; empty: by the record's length
  std::string intervals = "linear";  // or profile, bootstrap, posterior
  std::string loss = "squared";      // or huber, cauchy, tukey
  // The objective to minimise; empty: least squares, or MAP if the model has priors.
  // docs/cli.md lists the names.
  std::string objective;
  std::vector<std::string> channels = {"displacement"};
  std::vector<double> noise;   // known standard deviation of each channel, in the file's units
  std::optional<double> mass;  // on the load cell, kg
  bool stagewise = false;
  std::string bias = "auto";  // correction of the second-order bias: auto, off, always
};
struct CompareOptions : InputOptions {
  int figure = 0;                    // data of a figure of the paper, instead of a file
  std::vector<double> start;         // of the free parameters; empty: the model's
  std::vector<std::string> methods;  // empty: all
};
struct DropOptions {
  std::vector<std::filesystem::path> campaigns;  // of one damper, to be diagnosed
  std::filesystem::path diagnosis;               // folder of a diagnosis that is there already
  std::filesystem::path campaign;                // from which the model is identified as it is
  std::filesystem::path model, estimate;         // otherwise these
  std::optional<double> sink_speed, lift;
  std::optional<double> mass, shaker_mass;  // kg: above the damper in the drop, and on the shaker
  std::string rule, condition, weight, wing_loading;  // a rule's, the last two with their units
  std::optional<double> tyre_stiffness, tyre_damping, unsprung_mass;  // N/m, N s/m, kg
  std::vector<std::string> limits;                                    // FIGURE=VALUE with its unit
  std::string stroke_limit;           // the strut's greatest stroke with its unit; may be empty
  std::optional<double> piston_area;  // m^2
  std::filesystem::path measured;     // CSV of a measured drop; may be empty
  bool join = false;                  // it joins the estimate
  // How it fell, where that was otherwise: m/s, share of the weight, kg.
  std::optional<double> measured_sink_speed, measured_lift, measured_mass;
  std::string measured_noise;  // standard deviation of its stroke with its unit; may be empty
  double discharge_spread = 0.0, index_spread = 0.0;  // priors beyond the tested velocities
  std::vector<double> charge, oil, temperature;  // ranges of the servicing: from and to, or empty
  std::optional<double> tested_temperature;      // degC
  double duration = 1.5;
  int samples = 400;
  std::optional<double> identified_speed, identified_stroke;
  std::filesystem::path truth, svg, page;  // may be empty
};
struct ResponseOptions {
  std::filesystem::path model, svg;           // svg: empty, no picture
  std::optional<double> amplitude, from, to;  // over the frequency, Hz
  std::optional<double> frequency_hz;         // or over the amplitude, from [0] to [1]
  std::vector<double> amplitudes;
};
struct ReproduceOptions {
  int figure = 0;     // 0: all figures
  bool bias = false;  // show the paper's discretisation bias instead of a figure
};
struct PlanCommand {
  std::filesystem::path model, rig;  // rig: may be empty
  std::vector<double> frequencies_hz, amplitudes;
  double noise = 0.0;  // 0: that of the rig, otherwise that of a good transducer
  int points = 64, cycles = 20, runs = 3;
  unsigned threads = 0;
  std::string aim = "all";           // or "drop", or the name of a free parameter
  std::optional<double> sink_speed;  // of that drop
  double lift = 0.0;
  double prior_spread = 0.1;    // of a parameter without a prior, relative
  double minutes = 0.0;         // rig time of a set; 0: `cycles` in each run
  std::filesystem::path draw;   // HTML file; empty: none
  std::filesystem::path write;  // campaign file of the best set; empty: none
};
struct MonteCarloCommand {
  std::filesystem::path model;  // its start values are the truth
  int figure = 0;               // an experiment of the paper instead; 0: none
  std::vector<double> frequencies_hz, amplitudes;
  int points = 40, cycles = 1;
  double noise = 0.0;
  bool uniform = false, profile = false;
  std::string bias = "auto";  // as for an estimate
  long replications = 10000;
  unsigned threads = 0;
  std::uint64_t seed = 1;
  std::string shard = "1/1";
  std::filesystem::path keep;                // the part's replications; empty: nowhere
  std::vector<std::filesystem::path> merge;  // files of parts, in place of a computation
};
struct ExportOptions {
  std::filesystem::path campaign;  // a database, or a folder
  std::filesystem::path directory = ".";
  bool samples = false;  // raw samples instead of cycles
  bool all = false;      // also cycles that were not accepted
  std::string format = "csv";
};
struct ImportOptions {
  std::filesystem::path source;                    // a folder of CSV files, or a file
  std::filesystem::path out;                       // the campaign's folder: new or empty
  std::vector<std::string> units, columns;         // CHANNEL=UNIT, CHANNEL=NAME
  std::vector<double> frequencies_hz, amplitudes;  // one for all runs, or one for each
  std::string kind;                                // of all runs; empty: by their channels
  double reference_mass = 0.0;                     // kg; 0: none
};
struct DiagnoseCommandOptions {
  std::vector<std::filesystem::path> campaigns;  // folders with campaign.json, or databases
  std::filesystem::path model;
  std::filesystem::path out;  // empty: no files are written
  double false_alarm_rate = 0.01;
  bool thorough = false;  // search until nothing is left to try
  bool job = false;       // a job from the daemon, read from standard input
  bool daemon = false;    // the daemon does it; campaign: a name in its folder, or empty
};
struct CampaignsOptions {
  std::filesystem::path directory = "/var/lib/shakerd";
};
struct ShowOptions {
  std::filesystem::path file;
};
struct VerifyOptions {
  std::vector<std::filesystem::path> campaigns;
  bool seal = false;   // make one if everything fits
  std::string sha256;  // of the database, as a report says; may be empty
};
struct ReportOptions {
  DropOptions drop;           // campaigns, diagnosis, model and what falls; no drop without a speed
  std::filesystem::path out;  // the page (.html) or document (.pdf)
  std::string specimen, serial, rig, operator_name;
  bool force = false;  // replace a file that is there
};
struct PushOptions {
  std::vector<std::filesystem::path> campaigns = {"/var/lib/shakerd"};  // databases and folders
  std::string to;                 // connection string; empty: the environment of libpq
  std::string schema = "shaker";  // of the tables
  double patience_s = 30.0;       // the longest silence of the server
  bool print_schema = false;      // print the tables' SQL and do nothing else
};
struct NoteOptions {
  std::filesystem::path file;
  std::string text;
};
struct CheckOptions {
  std::filesystem::path file;
  std::filesystem::path rig;  // its limits are checked against a campaign; may be empty
};

int status(const Common& common);
int watch(const Common& common, const WatchOptions& options);
int run(const Common& common, const RunOptions& options);
int prove_deadman(const Common& common, const ProveOptions& options);
int order(const Common& common, const std::string& method);  // "stop", "estop", "ack" or "pause"
int resume(const Common& common);
int estimate(const Common& common, const EstimateOptions& options);
int estimate_channels(const Common& common, const EstimateOptions& options);
// True for folders that hold runs without a mean cycle; then the second one estimates.
bool holds_records(const EstimateOptions& options);
int estimate_records(const Common& common, const EstimateOptions& options);
int estimate_transient(const Common& common, const EstimateOptions& options);
int compare(const Common& common, const CompareOptions& options);
int drop(const Common& common, const DropOptions& options);
int drop_diagnosed(const Common& common, const DropOptions& options);
int response(const Common& common, const ResponseOptions& options);
int reproduce(const Common& common, const ReproduceOptions& options);
int plan(const Common& common, const PlanCommand& command);
int monte_carlo(const Common& common, const MonteCarloCommand& command);
int export_runs(const Common& common, const ExportOptions& options);
int import_campaign(const Common& common, const ImportOptions& options);
int diagnose(const Common& common, const DiagnoseCommandOptions& options);
int diagnose_job();  // started by the daemon: see daemon/workers/diagnosis_child.hpp
int diagnose_by_daemon(const Common& common, const DiagnoseCommandOptions& options);
int campaigns(const Common& common, const CampaignsOptions& options);
int show(const Common& common, const ShowOptions& options);
int note(const Common& common, const NoteOptions& options);
int check(const Common& common, const CheckOptions& options);
int verify(const Common& common, const VerifyOptions& options);
int report_campaign(const Common& common, const ReportOptions& options);
int push(const Common& common, const PushOptions& options);

// Reports an error: `sentence` to stderr and, with `json`, as an object to stdout. Returns
// `code`.
int fail(const Common& common, ExitCode code, const std::string& sentence);

}  // namespace shaker::cli
