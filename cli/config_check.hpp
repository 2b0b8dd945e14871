// What a configuration file is, and everything that can be known to be wrong with it before the
// daemon starts: its own text, the files that it names, the effects of its model, the signals of
// its DBC, a campaign's dwells against a rig's limits. Reads files; opens no device.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace shaker::cli {

struct CheckReport {
  std::string kind;                 // "rig", "model", "campaign", "DBC"; empty: could not be told
  std::vector<std::string> facts;   // what it says, for a person to compare with his intention
  std::vector<std::string> errors;  // sentences with their places
  std::vector<std::string> warnings;
};

CheckReport check_file(const std::filesystem::path& file, const std::filesystem::path& rig);

}  // namespace shaker::cli
