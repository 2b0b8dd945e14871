// A copy of the rig file as this daemon uses it, for the program that stops the exciter
// afterwards.
//
// The rig file may be edited while the daemon runs. shakerd-stop-exciter must stop the exciter
// that was driven, not the one that the file names later, even if the file is no longer valid.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.hpp"

namespace shaker::daemon {

// Path of the copy, in the folder that systemd provides to the service; empty without systemd.
std::filesystem::path used_rig_file();

// Replaces the copy atomically. Does nothing if `file` is empty.
Result<void> keep_used_rig(const std::filesystem::path& file, const std::string& text);

}  // namespace shaker::daemon
