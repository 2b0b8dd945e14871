// Counts the calls of operator new in this program. It is a separate file, so that the compiler
// cannot inline the replacement and warn about it.
#pragma once

namespace shaker::testing {

long allocations();

}  // namespace shaker::testing
