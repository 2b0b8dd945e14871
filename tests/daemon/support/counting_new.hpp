// How often this program has called operator new. In a file of its own, so that the compiler cannot
// see through the replacement and warn about it.
#pragma once

namespace shaker::testing {

long allocations();

}  // namespace shaker::testing
