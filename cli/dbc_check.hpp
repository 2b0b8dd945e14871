// Describes a DBC file for a person: its messages, their signals with unit and range, and the
// signals that a rig file uses.
#pragma once

#include <filesystem>
#include <string>

#include "cli/config_check.hpp"

namespace shaker::cli {

// `file`: the DBC file, whose content is `text`. `rig`: a rig file, or empty. Errors in
// `report` are errors of the DBC file, and signals that the rig needs but the file does not
// contain.
void check_dbc(const std::filesystem::path& file, const std::string& text,
               const std::filesystem::path& rig, CheckReport& report);

}  // namespace shaker::cli
