// Detects the kind of a configuration file and finds every error that is visible before the
// daemon starts: in its own text, in the files that it names, in the effects of its model, in
// the signals of its DBC, and in a campaign's setpoints against the limits of a rig. Reads
// files; opens no device.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace shaker::cli {

struct CheckReport {
  std::string kind;                 // "rig", "model", "campaign", "DBC"; empty: unknown
  std::vector<std::string> facts;   // the file's content, for a person to compare with the intent
  std::vector<std::string> errors;  // sentences that name the place
  std::vector<std::string> warnings;
  std::string bad_rig;  // the rig file, where that is what is wrong
};

// `rig`: the rig file for a campaign or a DBC file; may be empty. Errors are in the report.
CheckReport check_file(const std::filesystem::path& file, const std::filesystem::path& rig);

}  // namespace shaker::cli
