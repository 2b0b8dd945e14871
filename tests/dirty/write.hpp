// A dirty campaign as files: what `shakerctl diagnose` reads, and the truth beside.
#pragma once

#include <filesystem>

#include "tests/dirty/campaign.hpp"

namespace shaker::dirty {

// Writes FOLDER/INDEX/ with campaign.json, model.json and a CSV file a run, and the sealed
// FOLDER/INDEX.truth.json. Throws std::runtime_error where a file cannot be written.
void write_campaign(const Campaign& campaign, const std::filesystem::path& folder);

}  // namespace shaker::dirty
