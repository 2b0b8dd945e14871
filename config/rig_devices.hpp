// Reads the devices of a rig file: exciter and sensors. Used by config/rig.cpp only.
#pragma once

#include <string>

#include "config/object_reader.hpp"
#include "config/rig.hpp"

namespace shaker::config {

void read_exciter(const Node& node, const std::string& pointer, Findings& findings,
                  ExciterConfig& exciter);

// Returns nullopt if its kind is absent or unknown (with a finding).
std::optional<SensorConfig> read_sensor(const Node& node, const std::string& pointer,
                                        Findings& findings);

}  // namespace shaker::config
