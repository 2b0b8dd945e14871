// Reads a model from a node of a larger file, because a campaign may contain its model. Private
// to config/.
#pragma once

#include <string>

#include "config/model.hpp"
#include "config/object_reader.hpp"

namespace shaker::config {

ModelSpec read_model(const Node& node, const std::string& pointer, Findings& findings,
                     const std::string& origin);

}  // namespace shaker::config
