// The campaign databases of a directory, by name.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.hpp"

namespace shaker::record {

// "A run, 3 Hz" -> "A_run__3_Hz": no surprise for a shell or another file system. A campaign's file
// is this, "_", when it started, and ".db".
std::string file_stem(const std::string& campaign);

// The file that is meant by `name`: a file's name, or a campaign's, of which the newest is taken;
// empty: the newest of all. An Error says what there is.
Result<std::filesystem::path> find_campaign(const std::filesystem::path& directory,
                                            const std::string& name);

}  // namespace shaker::record
