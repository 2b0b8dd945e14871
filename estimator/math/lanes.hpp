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

// The largest magnitude that has been seen, lane by lane; what is no number is passed over.
SHAKER_INLINE void keep_largest(Lanes& largest, const Lanes& value) {
  const Lanes size = value < 0.0 ? -value : value;
  largest = size > largest ? size : largest;
}

// Bit l: lane l of the mask. Halves are put together until all bits stand in the first lane.
SHAKER_INLINE unsigned bits_of(const LaneMask& mask) {
  LaneMask bits = mask & LaneMask{1, 2, 4, 8, 16, 32, 64, 128};
  bits |= __builtin_shufflevector(bits, bits, 4, 5, 6, 7, 0, 1, 2, 3);
  bits |= __builtin_shufflevector(bits, bits, 2, 3, 0, 1, 6, 7, 4, 5);
  bits |= __builtin_shufflevector(bits, bits, 1, 0, 3, 2, 5, 4, 7, 6);
  return static_cast<unsigned>(bits[0]);
}

// Row l, lane k to row k, lane l, in eight rows.
SHAKER_INLINE void transpose(Lanes (&m)[kLanes]) {
  Lanes pairs[kLanes];
  for (int l = 0; l < kLanes; l += 2) {
    pairs[l] = __builtin_shufflevector(m[l], m[l + 1], 0, 8, 2, 10, 4, 12, 6, 14);
    pairs[l + 1] = __builtin_shufflevector(m[l], m[l + 1], 1, 9, 3, 11, 5, 13, 7, 15);
  }
  Lanes fours[kLanes];
  for (int half = 0; half < kLanes; half += 4) {
    for (int l = half; l < half + 2; ++l) {
      fours[l] = __builtin_shufflevector(pairs[l], pairs[l + 2], 0, 1, 8, 9, 4, 5, 12, 13);
      fours[l + 2] = __builtin_shufflevector(pairs[l], pairs[l + 2], 2, 3, 10, 11, 6, 7, 14, 15);
    }
  }
  for (int l = 0; l < 4; ++l) {
    m[l] = __builtin_shufflevector(fours[l], fours[l + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    m[l + 4] = __builtin_shufflevector(fours[l], fours[l + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  }
}

}  // namespace shaker::estimator
