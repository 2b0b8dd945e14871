// What databases of one campaign lack: the runs that were not measured, or not to their end, after
// a stop, a fault or a crash.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/campaign.hpp"

namespace shaker::cli {

// What is left of a campaign, and the rig on which the rest was measured.
struct MissingRuns {
  config::CampaignSpec campaign;
  std::string rig;
};

// The campaign of the first database, with those of its runs of which no database holds all
// accepted cycles; none if nothing is missing. `resumes` names the databases. An incomplete run
// is measured again from its first cycle. Reads the files. An Error names the file: it is no
// campaign database, holds no campaign that can be started, or belongs to another campaign, rig
// or serial number than the first.
Result<MissingRuns> missing_runs(const std::vector<std::filesystem::path>& databases);

}  // namespace shaker::cli
