// The title block of every page about a campaign: what was measured, where, when and by whom; its files
// and their hashes; what made the page, and when.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "record/campaign_database.hpp"
#include "report/page/page.hpp"

namespace shaker::cli {

// What no file says; empty: left out.
struct TitleWords {
  std::string specimen, serial, rig, operator_name;
  std::filesystem::path model;  // the model file
};

// `campaigns`: folders or databases. `row`: what the first database says; none for a folder. `done`:
// "diagnosed". Reads the files for their hashes; one that is still written has none.
report::TitleBlock campaign_title(const std::vector<std::filesystem::path>& campaigns,
                                  const std::optional<record::CampaignRow>& row,
                                  const std::string& done, const TitleWords& words = {});

}  // namespace shaker::cli
