// Tells the two places where a campaign is kept apart: a database of the daemon (.db, .sqlite), and
// a folder with campaign.json and a CSV file for each run.
#pragma once

#include <filesystem>

#include "base/result.hpp"

namespace shaker::cli {

bool is_database(const std::filesystem::path& file);  // by its name

// Returns an Error for a folder, which says what to give instead: the newest database in it, one of
// its CSV files, or the command that reads such a folder.
Result<void> expect_file(const std::filesystem::path& path);

}  // namespace shaker::cli
