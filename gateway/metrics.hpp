// What the gateway knows, in the text format of Prometheus (version 0.0.4). Pure.
#pragma once

#include <string>

#include "gateway/feed.hpp"

namespace shaker::gateway {

struct GatewayFigures {
  int browsers = 0;
  std::uint64_t given_up = 0;  // browsers that did not read
};

std::string metrics(const Feed& feed, const GatewayFigures& figures);

}  // namespace shaker::gateway
