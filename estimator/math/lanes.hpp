// Eight doubles side by side: one SIMD register with AVX-512, two with AVX2, four with SSE2.
// Functions that take or return them by value are inlined into a loop under SHAKER_SIMD_CLONES.
#pragma once

#include <cstdint>

#include "estimator/math/simd_math.hpp"

namespace shaker::estimator {

inline constexpr int kLanes = 8;

typedef double Lanes __attribute__((vector_size(64), aligned(64)));
typedef std::int64_t LaneMask __attribute__((vector_size(64), aligned(64)));

}  // namespace shaker::estimator
