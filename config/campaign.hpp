// The campaign file: the dwells to run and the number of cycles of each.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/model.hpp"
#include "config/origin.hpp"
#include "config/run_condition.hpp"

namespace shaker::config {

struct RunSpec {
  std::string name;  // unique in the campaign; default r01, r02, ...
  double frequency_hz = 0.0;
  double amplitude = 0.0;  // of the table's acceleration, m/s^2
  int cycles = 20;         // accepted cycles to measure
  // For parameters that differ from run to run. The name in it is not used.
  RunCondition condition = {};
};

// The online estimator's test for a parameter that changes during a run; one of the two rates
// is given.
struct ChangeDetectionSpec {
  double false_alarms_per_hour = 0.0;
  double false_alarms_per_run = 0.0;
};

struct CampaignSpec {
  std::string name;
  ModelSpec model;                // from "model": a path relative to the file, or inline
  std::vector<RunSpec> runs;      // a stepped sweep is a run for each of its steps
  int points_per_cycle = 64;      // equal steps of cyclic time in a resampled cycle
  int settle_cycles_max = 200;    // cycles before a run fails ("no steady state")
  double settle_tolerance = 3.0;  // allowed change between cycles, in units of the noise
  double ramp_s = 0.0;            // 0: the rig's own
  double forgetting = 1.0;        // weight of a cycle relative to the next one
  std::optional<ChangeDetectionSpec> change_detection;  // empty: no test
  double reference_mass =
      0.0;  // mass on a load cell, kg; 0: not given, the load cell is recorded only
  std::string origin;
  Specimen specimen;
  std::string resumes;  // name of the database whose missing runs these are; empty: none

  // False alarms per cycle for the test: the smallest value over all runs; 0 without a test.
  double false_alarms_per_cycle() const;
};

Result<CampaignSpec> load_campaign(const std::filesystem::path& file);
Result<CampaignSpec> parse_campaign(const std::string& text, const std::string& origin,
                                    const std::filesystem::path& directory);
// The reference mass in a campaign's text, whatever else it contains; 0 if there is none.
double reference_mass(const std::string& text);
// The whole campaign with its model inline; round-trips through parse_campaign.
std::string to_json_text(const CampaignSpec& campaign);

}  // namespace shaker::config
