// The number of allocations of this test program.
#pragma once

namespace shaker::estimator::testing {

long allocation_count();

}  // namespace shaker::estimator::testing
