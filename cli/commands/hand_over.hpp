// Runs a command that another program implements: that program replaces this process and gets
// the whole command line.
#pragma once

#include "cli/commands.hpp"

namespace shaker::cli {

// Returns only when `program` cannot be started, after it has reported the error.
int hand_over(const Common& common, const char* program);

}  // namespace shaker::cli
