// Finds campaign databases in a directory by name.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.hpp"

namespace shaker::record {

// "A run, 3 Hz" -> "A_run__3_Hz": safe for shells and other file systems. The file of a
// campaign is this name, "_", the time of its start, and ".db".
std::string file_stem(const std::string& campaign);

// The file for `name`: the name of a file or of a campaign (then its newest file); empty: the
// newest file of all. An Error states what the directory has.
Result<std::filesystem::path> find_campaign(const std::filesystem::path& directory,
                                            const std::string& name);

}  // namespace shaker::record
