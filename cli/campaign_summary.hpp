// What a campaign database holds, in short: for the list of campaigns and for one of them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/result.hpp"
#include "record/campaign_database.hpp"

namespace shaker::cli {

struct RunSummary {
  record::RunRow row;
  long accepted = 0, left_out = 0;  // cycles
};

struct CampaignSummary {
  record::CampaignRow row;
  std::string model;  // its name
  std::vector<RunSummary> runs;
  std::vector<record::Fact> facts;  // where its numbers come from
  // As they were published.
  std::vector<nlohmann::json> alarms;
  nlohmann::json estimate;  // the last one; null if there is none
};

// Reads campaign and runs; with `whole` also cycles, facts and documents. An Error is the
// reader's.
Result<CampaignSummary> summarise(const std::filesystem::path& database, bool whole);

// The databases of a directory, sorted by name. An Error names the directory.
Result<std::vector<std::filesystem::path>> databases_in(const std::filesystem::path& directory);

}  // namespace shaker::cli
