// How often a statistical test repeats. A sanitizer looks for errors of memory and of threads: a
// few repetitions show them as well as thousands, which take minutes there. The build without a
// sanitizer asserts what only the full count can show.
#pragma once

#include <algorithm>

namespace shaker {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif
#else
inline constexpr bool kSanitized = false;
#endif

// `count`, or a fiftieth of it under a sanitizer, but at least three.
constexpr int repetitions(int count) {
  return kSanitized ? std::max(3, count / 50) : count;
}

}  // namespace shaker
