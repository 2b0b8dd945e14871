// How often a statistical test repeats. A sanitizer looks for errors of memory and of threads: a few
// repetitions show them as well as thousands, which take minutes there. The build without a sanitizer
// asserts what only the full count can show.
#pragma once

#include <algorithm>

#include "base/sanitizer.hpp"

namespace shaker {

// `count`, or a fiftieth of it under a sanitizer, but at least three.
constexpr int repetitions(int count) {
  return kSanitized ? std::max(3, count / 50) : count;
}

}  // namespace shaker
