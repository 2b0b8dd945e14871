// The content of an export, read once from a campaign: a database, or a folder with campaign.json.
// The writers of the formats only lay it out.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "record/campaign_database.hpp"

namespace shaker::cli {

// One channel of a run, as the sensor delivered it.
struct ExportChannel {
  std::string name, unit;
  std::vector<double> t;              // s, from the first sample of the run
  std::vector<double> value;          // in `unit`
  std::vector<std::uint8_t> quality;  // 0 good, 1 suspect, 2 bad
};

struct ExportRun {
  record::RunRow row;
  std::vector<record::CycleRow> cycles;  // m, m/s^2; only accepted ones unless left_out was set
  std::vector<ExportChannel> channels;   // empty unless samples were requested

  double mean_frequency() const;  // Hz: the mean of its cycles, or the setpoint without cycles
};

struct ExportData {
  record::CampaignRow campaign;
  std::vector<ExportRun> runs;
};

struct ExportWanted {
  bool samples = false;
  bool left_out = false;  // also cycles that were not accepted
};

// `campaign`: a database, or a folder, whose periodic records are cut into their steady cycles. An
// Error names the place and the remedy.
Result<ExportData> read_export(const std::filesystem::path& campaign, const ExportWanted& wanted);

// A name as part of a path: '/', spaces, control characters, "..", and a '.' in front become
// '_'.
std::string plain_file_name(std::string name);
// "NAME_REST" as a file name, where NAME is the campaign's name.
std::string export_name(const ExportData& data, const std::string& rest);

}  // namespace shaker::cli
