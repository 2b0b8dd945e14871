// Who made a page and when, for its title block.
#pragma once

#include <string>

namespace shaker::cli {

// "2026-03-01 12:00:00 UTC by shakerctl 0.2.0", of now.
std::string made_by();

}  // namespace shaker::cli
