// A command that is in another program: this process becomes that program, with the whole command
// line as it was given.
#pragma once

#include "cli/commands.hpp"

namespace shaker::cli {

// Returns only where that has failed, after it has said so.
int hand_over(const Common& common, const char* program);

}  // namespace shaker::cli
