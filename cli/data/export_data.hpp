// What an export holds, read from a campaign's database once: the writers of formats only lay it out.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "record/campaign_database.hpp"

namespace shaker::cli {

// One channel of a run as it came from the sensor.
struct ExportChannel {
  std::string name, unit;
  std::vector<double> t;              // s, from the run's first sample
  std::vector<double> value;          // in `unit`
  std::vector<std::uint8_t> quality;  // 0 good, 1 suspect, 2 bad
};

struct ExportRun {
  record::RunRow row;
  std::vector<record::CycleRow> cycles;  // m, m/s^2; without those left out, unless asked for
  std::vector<ExportChannel> channels;   // empty, unless samples were asked for

  double mean_frequency() const;  // Hz, of its cycles; of the row where it has none
};

struct ExportData {
  record::CampaignRow campaign;
  std::vector<ExportRun> runs;
};

struct ExportWanted {
  bool samples = false;
  bool left_out = false;  // cycles too that were not accepted
};

Result<ExportData> read_export(const std::filesystem::path& database, const ExportWanted& wanted);

// "NAME_RUN_WHAT": letters that a file system may mind are '_'.
std::string export_name(const ExportData& data, const std::string& rest);

}  // namespace shaker::cli
