// The documents that shakerd publishes: one JSON object on each line. Schemas:
// protocol/schema/*.json (JSON Schema 2020-12); description: docs/protocol.md.
//
// The structs hold the contents of a document; `to_json_line` adds the envelope (type, seq,
// t_utc, t_mono_ns). A number that is not finite is omitted; "omitted" lists its JSON pointer
// and the reason (nlohmann-json would print null). Pure: no sockets, clocks or files.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace shaker::protocol {

// Limits of the rig, for views.
struct LimitsEntry {
  double stroke_min_m = 0.0, stroke_max_m = 0.0, stroke_rate_max_m_s = 0.0;
  double excitation_max_m_s2 = 0.0;
};
struct VersionDocument {
  std::string program = "shakerd";
  std::string version;
  int protocol = 1;
  std::string rig;
  std::optional<LimitsEntry> limits = {};
};

// state: "IDLE", "CHECK", "RAMP", "SETTLE", "MEASURE", "RAMP_DOWN", "FAULT", "PAUSE".
struct StateDocument {
  std::string state;
  std::string reason;  // reason for the transition, a sentence
  std::optional<std::string> campaign;
  std::optional<std::string> run;
  std::optional<int> run_index, run_count;
  std::optional<double> frequency_hz, amplitude;  // setpoint
  std::optional<double> progress;                 // of the campaign, 0..1
  std::optional<double> eta_s;
  bool controlled = false;   // a client holds the lease
  bool unprotected = false;  // no detector of the rig ends the motion, by its rig file
};

struct RunStartDocument {
  std::string campaign, run;
  int run_index = 0, run_count = 0;
  double frequency_hz = 0.0, amplitude = 0.0;
  int cycles_wanted = 0;
};

struct CycleDocument {
  std::string campaign, run;
  std::int64_t cycle = 0;  // number of the cycle in the run, from 0
  bool accepted = false;
  std::string why;            // reason if not accepted ("transient", "gap of 12 ms", ...)
  double frequency_hz = 0.0;  // measured
  double amplitude = 0.0;     // of the measured excitation's fundamental; 0: not measured
  double stroke_min_m = 0.0, stroke_max_m = 0.0;
  double change = 0.0;  // change from the previous cycle, in units of the noise
  int gaps = 0;
  std::int64_t samples = 0;
  double jitter_fraction = 0.0;    // in sample intervals
  std::optional<int> subharmonic;  // the response repeats after this number of periods
  // With a trimmed amplitude, m/s^2: ordered from the exciter at the end of the cycle, and ordered
  // from then on if the cycle led to a correction.
  std::optional<double> ordered = {}, corrected_to = {};
  std::optional<double> stroke_rate_m_s = {};  // largest speed of the stroke; of whole cycles
};

struct ParameterEntry {
  std::string name, effect, unit;
  double value = 0.0, standard_error = 0.0, lower = 0.0, upper = 0.0;
  bool fixed = false, at_bound = false, determined = true;
  std::optional<double> bias = std::nullopt;  // subtracted from the optimum to give `value`
};

struct EstimateDocument {
  std::optional<std::string> campaign, run;
  std::optional<std::int64_t> cycle;
  std::string model;
  std::vector<ParameterEntry> parameters;
  std::vector<std::string> covariance_order;
  std::vector<double> covariance;  // row by row
  double noise_standard_deviation = 0.0;
  double sum_of_squares = 0.0;
  double condition = 0.0;
  std::int64_t observations = 0, degrees_of_freedom = 0, cycles_used = 0;
  int runs_used = 0, iterations = 0;
  std::optional<std::int64_t> cycles_skipped;  // cycles for which the estimator was too slow
  std::optional<std::string> clock;            // the clock that stamped the samples
  std::optional<double> latency_s;             // from the last sample of the cycle to this document
  bool converged = false, usable = false;
  bool intervals_hold = true;  // false: the gap is more than noise explains
  // Root mean squares over the mean cycles, in the model's length unit: of measurement minus
  // simulation, and of the part that scatter explains.
  std::optional<double> gap, noise_floor;
  std::vector<std::string> warnings;
};

struct AlarmDocument {
  std::string severity;               // "info", "warning", "error"
  std::string code;                   // stable, e.g. "stale_sensor"
  std::string text;                   // a sentence with the remedy
  std::optional<std::string> action;  // "none", "indicate", "hold", "ramp_down", "stop"
  std::optional<std::string> channel;
  std::optional<double> value, limit;
  // For parameter_change: the parameter, the run, and the approximate cycle of the change;
  // `value` is the jump. `alone`: this change alone explains the data. `alternatives`:
  // parameters whose change would look alike or, if no single one explains the data, that also
  // raised an alarm.
  std::optional<std::string> parameter = std::nullopt, run = std::nullopt;
  std::optional<std::int64_t> cycle = std::nullopt;
  std::optional<double> standard_error = std::nullopt;  // of the jump
  std::optional<bool> alone = std::nullopt;
  std::vector<std::string> alternatives = {};
  // Code of the error that caused this one; empty for the first error of an incident.
  std::optional<std::string> cause = std::nullopt;
};

struct ChannelHealth {
  std::string channel, quality;  // "none", "good", "suspect", "bad"
  std::optional<double> age_s, rate_hz, value;
  std::optional<std::string> name = {};  // name of an auxiliary channel
  std::optional<std::string> unit = {};
};
struct HealthDocument {
  std::string state;
  std::vector<ChannelHealth> channels;
  std::string clock;
  std::uint64_t samples = 0, lost = 0, malformed = 0, errors = 0, reconnects = 0;
  std::uint64_t ring_overflows = 0, log_drops = 0, cycles_skipped = 0;
  int clients = 0;
  bool exciter_connected = false, sensor_connected = false;
  double loop_late_max_s = 0.0;  // largest delay of the engine's loop since the last one
  std::uint64_t disk_free_bytes = 0;
  std::optional<double> disk_flush_max_s;  // of a commit, since the last health document
};

// Cycle-to-cycle noise of the accepted cycles of a run (the rig's repeatability), and the part
// of it that the sensor's own noise causes in a point.
struct CycleNoiseEntry {
  std::int64_t cycles = 0;
  double point_m = 0.0;            // standard deviation of a point from cycle to cycle
  double sensor_m = 0.0;           // noise of the sensor, from within a cycle
  std::vector<std::string> order;  // "mean", "h1_along", "h1_across", ...: Fourier coefficients
  std::vector<double> covariance;  // m^2, in this order, row by row
};

struct RunStopDocument {
  std::string campaign, run;
  std::string status;  // "success", "abort", "fail"
  std::string reason;
  std::int64_t cycles_accepted = 0, cycles_rejected = 0;
  std::optional<CycleNoiseEntry> noise = {};  // with two accepted cycles or more
};

// A diagnosis of a recorded campaign is running.
struct DiagnosisProgressDocument {
  std::string campaign;
  std::string stage;   // "reading", "naming", ...
  double share = 0.0;  // completed part of the work, 0..1
};

// A diagnosis has ended.
struct DiagnosisResultDocument {
  std::string campaign, database;  // its name; the file name in the daemon's directory
  std::string status;              // "done", "cancelled", "failed"
  std::string reason;              // the result, or why it was cancelled or failed, as a sentence
  std::optional<std::string> folder = {};     // absolute path of the files; if done
  std::optional<std::string> diagnosis = {};  // shaker-diagnosis/1 as JSON text; if done
};

// --- Documents for people who look on. Only a client that subscribed gets them. No campaign
// database holds them, and they carry the seq of the newest numbered document.

// One measured cycle on equal steps of the cyclic time, from the peak of the excitation.
struct WaveDocument {
  int run_index = 0;
  std::int64_t cycle = 0;  // number of the cycle in the run, from 0
  bool accepted = false;
  double frequency_hz = 0.0;
  std::vector<double> stroke_m, excitation_m_s2;
  // At the last estimate; empty without one, or where they cannot be computed.
  std::vector<double> response_m, missing_force_m_s2;
};

// The smallest and the largest sample of each channel in bins of `bin_s`.
struct ScopeChannel {
  std::string channel;
  std::vector<std::int64_t> bin;  // the bin's begin over bin_s, on the clock of t_mono_ns
  std::vector<double> smallest, largest;
};
struct ScopeDocument {
  double bin_s = 0.0;
  std::vector<ScopeChannel> channels;
};

// The rig as its file describes it, who is in control, and the campaign that began last.
struct RigChannel {
  std::string channel, name, unit;
};
struct RigDetector {
  std::string detector, action;
};
struct PlannedRun {
  std::string run;
  double frequency_hz = 0.0, amplitude = 0.0;
  int cycles_wanted = 0;
};
struct PlannedCampaign {
  std::string campaign;
  double settle_tolerance = 0.0;  // allowed change between cycles, in units of the noise
  std::vector<PlannedRun> runs;
  // What is tested, by the keys of the campaign file ("serial", "charge", ...): key and text.
  std::vector<std::pair<std::string, std::string>> specimen = {};
};
struct RigDocument {
  std::string rig;
  double stroke_min_m = 0.0, stroke_max_m = 0.0, stroke_rate_max_m_s = 0.0;
  double excitation_max_m_s2 = 0.0, frequency_min_hz = 0.0, frequency_max_hz = 0.0;
  double stale_s = 0.0, ramp_s = 0.0, client_lease_s = 0.0;
  bool unprotected = false;  // no detector of the rig ends the motion
  std::vector<RigDetector> detectors;
  std::vector<RigChannel> channels;
  std::optional<std::string> in_control = {};  // "anna (pid 4711)"
  std::optional<PlannedCampaign> plan = {};
};

using Document =
    std::variant<VersionDocument, StateDocument, RunStartDocument, CycleDocument, EstimateDocument,
                 AlarmDocument, HealthDocument, RunStopDocument, DiagnosisProgressDocument,
                 DiagnosisResultDocument, WaveDocument, ScopeDocument, RigDocument>;

struct Envelope {
  std::uint64_t seq = 0;
  std::string t_utc;
  std::int64_t t_mono_ns = 0;
};

// "version", "state", "run_start", "cycle", "estimate", "alarm", "health", "run_stop",
// "diagnosis_progress", "diagnosis_result", "wave", "scope", "rig".
std::string_view type_name(const Document& document);

// One line without the newline, valid UTF-8, at most 1 MiB.
std::string to_json_line(const Document& document, const Envelope& envelope);

// The document without its envelope, pretty-printed, as `shakerctl estimate --json` prints it.
std::string to_json_text(const Document& document);

}  // namespace shaker::protocol
