// The device part of a rig file: exciter and sensors. Only config/rig.cpp uses it.
#pragma once

#include <string>

#include "config/object_reader.hpp"
#include "config/rig.hpp"

namespace shaker::config {

void read_exciter(const Node& node, const std::string& pointer, Findings& findings,
                  ExciterConfig& exciter);

// nullopt when its kind is missing or unknown (with a finding).
std::optional<SensorConfig> read_sensor(const Node& node, const std::string& pointer,
                                        Findings& findings);

}  // namespace shaker::config
