// The number of repetitions of a statistical test. A sanitizer looks for errors of memory and
// threads, which a few repetitions show as well as thousands, and thousands take minutes there.
// The build without a sanitizer checks what needs the full number. For scripts: sanitized.py.
#pragma once

#include <algorithm>
#include <initializer_list>
#include <vector>

#include "base/sanitizer.hpp"

namespace shaker {

// `count`, or a fiftieth of it under a sanitizer, but at least three.
constexpr int repetitions(int count) {
  return kSanitized ? std::max(3, count / 50) : count;
}

// All cases; under a sanitizer the first, since one takes the path that all take.
template <class Case>
std::vector<Case> some(std::initializer_list<Case> cases) {
  return {cases.begin(), kSanitized ? cases.begin() + 1 : cases.end()};
}

}  // namespace shaker
