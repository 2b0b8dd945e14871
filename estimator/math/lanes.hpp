// Eight doubles side by side: one SIMD register with AVX-512, two with AVX2, four with SSE2.
// Functions that take or return them by value are inlined into a loop under SHAKER_SIMD_CLONES.
#pragma once

#include <cstdint>

#include "estimator/math/simd_math.hpp"

namespace shaker::estimator {

inline constexpr int kLanes = 8;

typedef double Lanes __attribute__((vector_size(64), aligned(64)));
typedef std::int64_t LaneMask __attribute__((vector_size(64), aligned(64)));
typedef std::uint64_t LaneBits __attribute__((vector_size(64), aligned(64)));

SHAKER_INLINE void fast_log(const Lanes& x, Lanes& out) {
  logarithm_of<Lanes, LaneBits>(x, out);
}
SHAKER_INLINE void fast_exp(const Lanes& x, Lanes& out) {
  exponential_of<Lanes, LaneBits>(x, out);
}

// Arrays of doubles on 64-byte boundaries, eight at a time.
inline Lanes* as_lanes(double* p) {
  return reinterpret_cast<Lanes*>(p);
}
inline const Lanes* as_lanes(const double* p) {
  return reinterpret_cast<const Lanes*>(p);
}

// 0 in lanes that are infinite or no number.
SHAKER_INLINE void keep_finite(Lanes& x) {
  x = x - x == 0.0 ? x : Lanes{};
}

// Bit l: lane l of the mask.
SHAKER_INLINE unsigned bits_of(const LaneMask& mask) {
  unsigned set = 0;
  for (int l = 0; l < kLanes; ++l)
    set |= mask[l] != 0 ? 1U << l : 0U;
  return set;
}

}  // namespace shaker::estimator
