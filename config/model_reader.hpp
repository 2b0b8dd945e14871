// A model from a node of a larger file: a campaign may hold its model inline. Only config/ uses it.
#pragma once

#include <string>

#include "config/model.hpp"
#include "config/object_reader.hpp"

namespace shaker::config {

ModelSpec read_model(const Node& node, const std::string& pointer, Findings& findings,
                     const std::string& origin);

}  // namespace shaker::config
