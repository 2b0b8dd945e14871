// What the gateway knows, in the text format of Prometheus (version 0.0.4). Pure.
#pragma once

#include <string>
#include <vector>

#include "gateway/feed.hpp"

namespace shaker::gateway {

struct GatewayFigures {
  int browsers = 0;
  std::uint64_t given_up = 0;  // browsers that did not read
};

struct RigFeed {
  std::string name;  // the label "rig" of every figure of this rig; empty: there is no label
  const Feed* feed = nullptr;
};

std::string metrics(const std::vector<RigFeed>& rigs, const GatewayFigures& figures);

}  // namespace shaker::gateway
