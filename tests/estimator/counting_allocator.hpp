// How often this test program has allocated.
#pragma once

namespace shaker::estimator::testing {

long allocation_count();

}  // namespace shaker::estimator::testing
