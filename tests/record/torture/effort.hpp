// The number of trials: the short form, or that of torture.py.
#pragma once

#include <cstdint>
#include <cstdlib>

namespace shaker::record::torture {

struct Effort {
  int count = 0;  // 0: the short form
  std::uint64_t seed = 20260301;
};

inline Effort effort() {
  Effort effort;
  if (const char* count = std::getenv("RECORD_TORTURE_COUNT")) effort.count = std::atoi(count);
  if (const char* seed = std::getenv("RECORD_TORTURE_SEED"))
    effort.seed = std::strtoull(seed, nullptr, 10);
  return effort;
}

}  // namespace shaker::record::torture
