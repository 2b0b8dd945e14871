// What a DBC file says, for a person: its messages, their signals with unit and range, and which of
// them a rig file uses.
#pragma once

#include <filesystem>
#include <string>

#include "cli/config_check.hpp"

namespace shaker::cli {

// `rig`: a rig file, or empty. Errors: what is wrong in the DBC, and what the rig asks for in vain.
void check_dbc(const std::filesystem::path& file, const std::string& text,
               const std::filesystem::path& rig, CheckReport& report);

}  // namespace shaker::cli
