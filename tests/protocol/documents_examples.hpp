// A plain and a difficult example of each document.
#pragma once

#include <limits>
#include <vector>

#include "protocol/documents.hpp"

namespace shaker::protocol::testing {

inline EstimateDocument plain_estimate() {
  EstimateDocument d;
  d.campaign = "first light";
  d.run = "r01";
  d.cycle = 3;
  d.model = "oleo";
  d.parameters = {
      {"theta1", "orifice_damping", "kg/m", 16.25, 0.5, 15.25, 17.25, false, false, true, 0.0625},
      {"theta2", "gas_spring", "m/s^2", 2.0, 0.25, 1.5, 2.5, false, true, true},
      {"g", "gravity", "m/s^2", 9.80665, 0.0, 9.80665, 9.80665, true, false, true}};
  d.covariance_order = {"theta1", "theta2"};
  d.covariance = {0.25, -0.125, -0.0625, 0.0625};
  d.noise_standard_deviation = 2e-5;
  d.sum_of_squares = 1e-7;
  d.condition = 12.5;
  d.observations = 256;
  d.degrees_of_freedom = 254;
  d.cycles_used = 4;
  d.runs_used = 1;
  d.iterations = 5;
  d.cycles_skipped = 0;
  d.clock = "simulated";
  d.latency_s = 4.5e-4;
  d.converged = d.usable = true;
  d.warnings = {"theta2 stands at its lower bound."};
  return d;
}

inline WaveDocument plain_wave() {
  return {0, 7, true, 2.5, {0.1, 0.2}, {3.0, -3.0}, {0.1, 0.2}, {0.5, -0.5}};
}

inline RigDocument plain_rig() {
  RigDocument rig{"rig A", -0.01, 0.3, 3.0, 15.0, 0.2, 10.0, 0.05, 2.0, 2.0, false, {}, {}, {}, {}};
  rig.detectors = {{"stroke_action", "stop"}};
  rig.channels = {{"displacement", "displacement", "m"}, {"aux1", "oil", "degC"}};
  rig.in_control = "anna (pid 4711)";
  rig.plan = PlannedCampaign{"first light", 3.0, {{"r01", 2.5, 3.0, 20}}};
  rig.plan->specimen = {{"serial", "N-042"}, {"charge", "18 bar"}};
  return rig;
}

inline std::vector<Document> plain_documents() {
  StateDocument state{
      "MEASURE", "The response is steady.", "first light", "r01", 0, 2, 2.5, 3.0, 0.25, 17.5, true};
  CycleDocument cycle{"first light", "r01", 7, false, "gap of 12 ms", 2.5001, 2.99, -0.01,
                      0.12,          1.5,   1, 400,   0.02,           2,      3.4,  3.45,
                      0.25};
  HealthDocument health;
  health.state = "IDLE";
  health.channels = {{"displacement", "good", 0.001, 1000.0, 0.1},
                     {"excitation", "none", {}, {}, {}}};
  health.clock = "simulated";
  health.samples = 123456;
  health.clients = 2;
  return {
      VersionDocument{"shakerd", "0.1.0", 1, "rig A", LimitsEntry{0.0, 0.3, 3.0, 15.0}},
      state,
      RunStartDocument{"first light", "r01", 0, 2, 2.5, 3.0, 20},
      cycle,
      plain_estimate(),
      AlarmDocument{"error", "stale_sensor", "No sample for 60 ms.", "ramp_down", "displacement",
                    0.06, 0.05},
      health,
      RunStopDocument{
          "first light", "r01", "success", "All cycles are measured.", 20, 3,
          CycleNoiseEntry{20, 2e-5, 1.9e-5, {"mean", "h1_along"}, {4e-12, -1e-12, -1e-12, 9e-12}}},
      DiagnosisProgressDocument{"first light", "naming", 0.5},
      DiagnosisResultDocument{
          "first light", "first_light_20260301T120000Z.db", "done", "Nothing is missing.",
          "/data/first_light_20260301T120000Z.diagnosis",
          R"({"format": "shaker-diagnosis/1", "verdict": "adequate", "effects": [],
              "runs": [{"name": "r01", "role": "fit", "before": 1e-5, "after": 1e-5,
                        "noise": 8e-6, "noise_floor": 1e-5}],
              "gap": {"noise": 8e-6, "noise_floor": 1e-5, "before": 1e-5, "after": 1e-5, "unit": "m"},
              "ranking": [], "not_tried": [], "parameters_before": [], "parameters_after": [],
              "false_alarm_rate": 0.01, "warnings": []})"},
      plain_wave(),
      ScopeDocument{0.02, {{"displacement", {100, 101}, {0.1, 0.1}, {0.2, 0.25}}}},
      plain_rig()};
}

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Text that is not UTF-8, and strings beyond every limit.
struct NastyText {
  std::string rubbish = std::string("\xff\xfe\xc3(\xed\xa0\x80 \"quoted\"\n\t\\") + '\0' + "end";
  std::string huge = std::string(5000, '\x01');
  std::string wide;
  NastyText() {
    while (wide.size() < 5000)
      wide += "\xe2\x82\xac";  // the euro sign: three bytes
  }
};

inline void add_nasty_estimates(const NastyText& text, std::vector<Document>& all) {
  EstimateDocument undetermined = plain_estimate();
  undetermined.parameters[0].standard_error = undetermined.parameters[0].lower = kNan;
  undetermined.covariance[3] = kInfinite;
  undetermined.condition = kInfinite;
  all.push_back(undetermined);
  EstimateDocument worst = plain_estimate();
  worst.parameters.assign(
      300, {text.huge, text.huge, text.huge, kNan, kNan, kNan, kNan, false, false, false});
  worst.warnings.assign(300, text.huge);
  worst.covariance_order.assign(100, text.huge);
  worst.covariance.assign(10'000, -1.0 / 3.0);
  all.push_back(worst);
  worst.covariance_order.assign(64, text.huge);
  worst.covariance.assign(64 * 64, -1.2345678901234567e-300);
  all.push_back(worst);
}

inline HealthDocument nasty_health() {
  HealthDocument health;
  health.state = "FAULT";
  health.channels.assign(1000, {"force", "bad", kNan, kNan, kNan});
  health.loop_late_max_s = kNan;
  health.samples = 1ULL << 62U;
  return health;
}

inline AlarmDocument nasty_change(const NastyText& text) {
  AlarmDocument changed{"warning", "parameter_change", text.wide, "indicate", {}, -0.05, {}};
  changed.parameter = "theta1";
  changed.run = text.rubbish;
  changed.cycle = 51;
  changed.standard_error = kNan;
  changed.alone = false;
  changed.alternatives = {"theta2", text.huge};
  return changed;
}

inline RigDocument nasty_rig(const NastyText& text) {
  RigDocument odd{text.huge, kNan, kNan, kNan, kInfinite, kNan,         kNan, kNan,
                  kNan,      kNan, true, {},   {},        text.rubbish, {}};
  odd.detectors.assign(100, {text.huge, text.rubbish});
  odd.channels.assign(100, {text.wide, text.huge, text.rubbish});
  odd.plan =
      PlannedCampaign{text.huge, 3.0, std::vector<PlannedRun>(1000, {text.rubbish, 2.5, 3.0, 20})};
  odd.plan->specimen = {{"serial", text.huge}, {"notes", text.rubbish}};
  return odd;
}

// NaN and infinite numbers, text that is not UTF-8, lists and strings beyond every limit.
inline std::vector<Document> nasty_documents() {
  const NastyText text;
  const auto& [rubbish, huge, wide] = text;
  std::vector<Document> all = plain_documents();
  all.push_back(VersionDocument{rubbish, huge, 1, wide});
  all.push_back(
      StateDocument{"IDLE", huge, rubbish, wide, 0, 1, kNan, kInfinite, kNan, -kInfinite, false});
  all.push_back(RunStartDocument{rubbish, wide, 0, 1, kNan, kInfinite, 20});
  all.push_back(CycleDocument{
      huge, "r", 1, false, rubbish, kNan, kNan, kNan, kNan, kInfinite, 0, 0, kNan, {}, kNan, kNan});
  add_nasty_estimates(text, all);
  all.push_back(AlarmDocument{"info", rubbish, huge, "none", rubbish, kNan, -kInfinite});
  all.push_back(nasty_health());
  all.push_back(RunStopDocument{rubbish, huge, "fail", huge, 0, 0});
  all.push_back(nasty_change(text));
  all.push_back(DiagnosisProgressDocument{rubbish, huge, kNan});
  all.push_back(WaveDocument{0,
                             1,
                             false,
                             kNan,
                             std::vector<double>(5000, -1.234567890123e-300),
                             {1.0, kInfinite},
                             {},
                             {kNan}});
  const std::vector<std::int64_t> late(5000, 1LL << 60);
  all.push_back(ScopeDocument{
      kInfinite, std::vector<ScopeChannel>(100, {huge, late, {kNan}, {1.0, -kInfinite}})});
  all.push_back(nasty_rig(text));
  all.push_back(DiagnosisResultDocument{rubbish, huge, "failed", rubbish, {}, {}});
  const std::string endless = "[\"" + std::string(1'000'000, 'x') + "\"]";
  all.push_back(DiagnosisResultDocument{rubbish, huge, "done", huge, huge, endless});
  all.push_back(DiagnosisResultDocument{rubbish, huge, "done", huge, huge, "[broken"});
  return all;
}

}  // namespace shaker::protocol::testing
