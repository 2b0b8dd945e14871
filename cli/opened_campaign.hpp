// Opens campaigns for the commands: the one place that says what a campaign is.
//
// A campaign is a database of the daemon (.db, .sqlite) or a folder with campaign.json and one CSV
// file for each run. Several of them are one campaign of one damper: their runs are taken together.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/model.hpp"
#include "estimator/diagnosis/campaign.hpp"
#include "record/campaign_database.hpp"

namespace shaker::cli {

struct OpenedCampaign {
  config::ModelSpec model;
  estimator::diagnosis::Campaign campaign;  // in the model's length unit and seconds
  std::optional<record::CampaignRow> row;   // what the first database says of itself
};

enum class Place { database, folder, other };

// Tells by its name and content what `path` is. `other`: a file of another kind, or nothing.
Place place_of(const std::filesystem::path& path);

// An Error names a path that is no campaign, says what it is and what it lacks.
Result<void> expect_campaign(const std::filesystem::path& path);

// The model of `model`, or of the first database where that is empty. An Error says that folders
// know no model, or that two databases hold different ones.
Result<config::ModelSpec> model_of_campaigns(const std::vector<std::filesystem::path>& places,
                                             const std::filesystem::path& model);

// That a campaign has a run which one before it has: its noise would count twice.
Error held_twice(const std::filesystem::path& place, const std::string& run,
                 const std::string& before);

// Reads all runs. A run whose name occurs twice gets the name of its campaign in front. An Error
// names the place and the remedy.
Result<OpenedCampaign> open_campaigns(const std::vector<std::filesystem::path>& places,
                                      const std::filesystem::path& model);

}  // namespace shaker::cli
