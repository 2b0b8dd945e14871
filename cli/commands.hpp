// shakerctl's commands: one function each, one file each in cli/commands/. They write results to
// stdout and what went wrong, a sentence, to stderr; with `json` an object {"error": ...} to stdout
// too. They return an ExitCode and throw nothing.
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
  std::filesystem::path campaign;
};
struct ProveOptions {
  double frequency_hz = 0.0, amplitude = 0.0;  // m/s^2
};
struct EstimateOptions : InputOptions {
  int starts = 1;  // more: from so many, see estimator/optimise/several_starts.hpp
  unsigned seed = 1;
  double accuracy = 0.0;  // of the parameters, relative; 0: a fixed grid
  // A record that is not periodic.
  bool transient = false;
  std::vector<double> initial;       // known initial states; empty: estimated
  std::string integrator;            // "adams", "bdf", "rk4"; empty: by the record's length
  std::string intervals = "linear";  // or profile, bootstrap, posterior
  std::string loss = "squared";      // or huber, cauchy, tukey
  // What is minimised; empty: least squares, with the model's priors where it has some. See
  // docs/cli.md for the names.
  std::string objective;
  std::vector<std::string> channels = {"displacement"};
  std::vector<double> noise;   // standard deviation of each channel, where it is known
  std::optional<double> mass;  // on the load cell, kg
  bool stagewise = false;
  std::string bias = "auto";  // of second order: auto, off, always
};
struct CompareOptions : InputOptions {
  int figure = 0;                    // of the paper, instead of a file
  std::vector<double> start;         // of the free parameters; empty: the model's
  std::vector<std::string> methods;  // empty: all
};
struct DropOptions {
  std::filesystem::path campaign;         // identifies the model, and where it was identified
  std::filesystem::path model, estimate;  // else: these
  double sink_speed = 0.0;
  double lift = 0.0;
  std::optional<double> mass;
  double duration = 1.5;
  int samples = 400;
  std::optional<double> identified_speed, identified_stroke;
  std::filesystem::path truth, svg;  // may be empty
};
struct ResponseOptions {
  std::filesystem::path model, svg;           // svg: empty, no picture
  std::optional<double> amplitude, from, to;  // over the frequency, Hz
  std::optional<double> frequency_hz;         // or over the amplitude, from [0] to [1]
  std::vector<double> amplitudes;
};
struct ReproduceOptions {
  int figure = 0;     // 0: all of them
  bool bias = false;  // what the paper's test hides, instead of a figure
};
struct PlanCommand {
  std::filesystem::path model, rig;  // the rig may be empty
  std::vector<double> frequencies_hz, amplitudes;
  double noise = 0.0;  // 0: the rig's, else a good transducer's
  int points = 64, cycles = 20, runs = 3;
  unsigned threads = 0;
  std::filesystem::path draw;  // HTML; empty: none
};
struct MonteCarloCommand {
  std::filesystem::path model;  // its starts are the truth
  int figure = 0;               // the paper's experiment instead; 0: none
  std::vector<double> frequencies_hz, amplitudes;
  int points = 40, cycles = 1;
  double noise = 0.0;
  bool uniform = false, profile = false;
  std::string bias = "auto";  // as of an estimate
  long replications = 10000;
  unsigned threads = 0;
  std::uint64_t seed = 1;
};
struct ExportOptions {
  std::filesystem::path database;
  std::filesystem::path directory = ".";
  bool samples = false;  // raw samples instead of cycles
  bool all = false;      // cycles that were left out, too
  std::string format = "csv";
};
struct DiagnoseCommandOptions {
  std::filesystem::path campaign;  // a folder with campaign.json, or a database
  std::filesystem::path model;
  std::filesystem::path out;  // empty: nothing is written
  double false_alarm_rate = 0.01;
  bool thorough = false;  // as long as there is more to try
  bool job = false;       // one of the daemon, read from standard input
  bool daemon = false;    // by the daemon: campaign is then a name in its directory, or empty
};
struct CheckOptions {
  std::filesystem::path file;
  std::filesystem::path rig;  // a campaign is held against its limits; may be empty
};

int status(const Common& common);
int watch(const Common& common, const WatchOptions& options);
int run(const Common& common, const RunOptions& options);
int prove_deadman(const Common& common, const ProveOptions& options);
int order(const Common& common, const std::string& method);  // stop, estop, ack
int estimate(const Common& common, const EstimateOptions& options);
int estimate_channels(const Common& common, const EstimateOptions& options);
int estimate_transient(const Common& common, const EstimateOptions& options);
int compare(const Common& common, const CompareOptions& options);
int drop(const Common& common, const DropOptions& options);
int response(const Common& common, const ResponseOptions& options);
int reproduce(const Common& common, const ReproduceOptions& options);
int plan(const Common& common, const PlanCommand& command);
int monte_carlo(const Common& common, const MonteCarloCommand& command);
int export_runs(const Common& common, const ExportOptions& options);
int diagnose(const Common& common, const DiagnoseCommandOptions& options);
int diagnose_job();  // asked for by the daemon: daemon/workers/diagnosis_child.hpp
int diagnose_by_daemon(const Common& common, const DiagnoseCommandOptions& options);
int check(const Common& common, const CheckOptions& options);

// Says what went wrong and gives `code` back.
int fail(const Common& common, ExitCode code, const std::string& sentence);

}  // namespace shaker::cli
