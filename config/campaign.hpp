// The campaign file: which dwells to run and how many cycles of each.
// Schema: config/schema/campaign.schema.json.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/model.hpp"

namespace shaker::config {

struct RunSpec {
  std::string name;  // unique in the campaign; default r01, r02, ...
  double frequency_hz = 0.0;
  double amplitude = 0.0;  // of the table's acceleration, m/s^2
  int cycles = 20;         // accepted cycles to measure
};

// The online estimator's test for a parameter that changes while it runs; one of the two is given.
struct ChangeDetectionSpec {
  double false_alarms_per_hour = 0.0;
  double false_alarms_per_run = 0.0;
};

struct CampaignSpec {
  std::string name;
  ModelSpec model;  // from "model": a path relative to the file, or inline
  std::vector<RunSpec> runs;
  int points_per_cycle = 64;      // a cycle is resampled on so many equal steps of cyclic time
  int settle_cycles_max = 200;    // give up ("no steady state") after so many
  double settle_tolerance = 3.0;  // cycle-to-cycle change below so many times the noise
  double ramp_s = 0.0;            // 0: the rig's own
  double forgetting = 1.0;        // weight of a cycle in the estimate for each cycle of its age
  std::optional<ChangeDetectionSpec> change_detection;  // none: no test
  double reference_mass =
      0.0;  // that a load cell carries, kg; 0: not said, a load cell is recorded
  std::string origin;

  // Of the test, in one cycle of the run in which cycles are shortest; 0 without a test.
  double false_alarms_per_cycle() const;
};

Result<CampaignSpec> load_campaign(const std::filesystem::path& file);
Result<CampaignSpec> parse_campaign(const std::string& text, const std::string& origin,
                                    const std::filesystem::path& directory);
// The reference mass of a campaign's file, whatever else it holds; 0 where it says none.
double reference_mass(const std::string& text);
// The whole campaign with its model inline; round-trips through parse_campaign.
std::string to_json_text(const CampaignSpec& campaign);

}  // namespace shaker::config
