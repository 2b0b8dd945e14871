// The rig file as this daemon uses it, kept for whoever must stop the exciter after it.
//
// Somebody may edit the rig file while the daemon runs. shakerd-stop-exciter must stop the exciter
// that was driven, not the one that the file names by then, and it must do so even when the file is
// no longer good.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.hpp"

namespace shaker::daemon {

// Where the copy is: in the folder that systemd gives the service, empty without one.
std::filesystem::path used_rig_file();

// Replaces the copy as a whole. Nothing is done where `file` is empty.
Result<void> keep_used_rig(const std::filesystem::path& file, const std::string& text);

}  // namespace shaker::daemon
