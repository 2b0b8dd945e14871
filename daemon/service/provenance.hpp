// What every campaign's database says of the rig and the programs that measured it: the rig file
// with what it includes, the limits in force, the sensors, the programs and the host.
#pragma once

#include <filesystem>
#include <vector>

#include "config/rig.hpp"
#include "record/provenance.hpp"

namespace shaker::daemon {

// Reads the files that the rig file names; a file that cannot be read has the reason as its value.
// Call it before anything moves: it waits for the disk.
std::vector<record::Fact> facts_of_rig(const config::RigConfig& rig,
                                       const std::filesystem::path& file);

}  // namespace shaker::daemon
