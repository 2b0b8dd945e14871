// Reads a campaign for the diagnosis: a folder with campaign.json ("shaker-campaign/1") and one
// CSV file for each run, or a campaign database of the daemon.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.hpp"
#include "config/model.hpp"
#include "estimator/diagnosis/campaign.hpp"

namespace shaker::cli {

// `path`: a folder or a database (.db, .sqlite). The columns of a folder are converted to the
// model's length unit and to seconds. A gravity in campaign.json replaces that of `model`. A
// database is in m and s; its numbers are not converted. An Error names file, line, place and
// remedy: for example units that do not match, a missing file, an unknown key or kind. A model whose
// length unit is empty receives that of the campaign: an angle's, or m.
Result<estimator::diagnosis::Campaign> read_campaign(const std::filesystem::path& path,
                                                     config::ModelSpec& model);

// The same for a folder, given its campaign.json.
Result<estimator::diagnosis::Campaign> read_campaign_file(const std::filesystem::path& file,
                                                          config::ModelSpec& model);

}  // namespace shaker::cli
