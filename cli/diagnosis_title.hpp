// The title block of a diagnosis: what was measured where and when, and what diagnosed it when.
#pragma once

#include <filesystem>
#include <optional>

#include "record/campaign_database.hpp"
#include "report/diagnosis_page.hpp"

namespace shaker::cli {

// `campaign`: the folder or the database. `row`: what the database says; none for a folder.
report::TitleBlock title_of(const std::filesystem::path& campaign,
                            const std::optional<record::CampaignRow>& row);

}  // namespace shaker::cli
