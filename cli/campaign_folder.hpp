// A campaign for the discrepancy workflow: a folder with campaign.json ("shaker-campaign/1") and
// one CSV a run, or a campaign database of the daemon.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.hpp"
#include "config/model.hpp"
#include "estimator/discrepancy/campaign.hpp"

namespace shaker::cli {

// Columns are put into the model's length unit and seconds. An Error names file, line, place and
// remedy: units that do not match, a run without its file, a key or a kind that there is not.
Result<estimator::discrepancy::Campaign> read_campaign(const std::filesystem::path& path,
                                                       config::ModelSpec& model);

// Of a folder, by its campaign.json.
Result<estimator::discrepancy::Campaign> read_campaign_file(const std::filesystem::path& file,
                                                            config::ModelSpec& model);

}  // namespace shaker::cli
