// The signals that ask a program to end, as a file descriptor for its loop.
#pragma once

#include "base/unique_fd.hpp"

namespace shaker {

// Blocks SIGTERM and SIGINT for the calling thread and those that it starts from then on; call it
// before there are others. The descriptor is readable once one of the two has come, and not valid
// if the process has no descriptor left.
UniqueFd ending_signals();

}  // namespace shaker
