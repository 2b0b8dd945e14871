/// \file
/// Batches of eight doubles, one in each SIMD lane: two registers with AVX2, four with SSE2. One
/// register of AVX-512 could hold all eight. But g++ 12 keeps vectors that are wider than a
/// machine's registers in memory and assembles them there in parts, for which the following
/// loads must wait: on a machine with AVX2 this costs a factor of two to five. With AVX-512, two
/// registers take a tenth to a quarter longer than one (docs/benchmarks.md). Functions that take
/// or return batches by value are inlined into a loop under SHAKER_SIMD_CLONES.
#pragma once

#include <cstdint>

#include "estimator/math/simd_math.hpp"

namespace shaker::estimator {

/// Number of lanes of a batch.
inline constexpr int kLanes = 8;

/// Four doubles: half of a batch.
typedef double HalfLanes __attribute__((vector_size(32)));
/// Half of a mask.
typedef std::int64_t HalfMask __attribute__((vector_size(32)));
/// The bits of half of a batch.
typedef std::uint64_t HalfBits __attribute__((vector_size(32)));

/// A mask: in each lane all bits are set, or none.
struct alignas(64) LaneMask {
  /// Lanes 0 to 3 and 4 to 7.
  /// @{
  HalfMask low, high;
  /// @}

  /// \param lane 0 to 7
  /// \return the bits of the lane
  std::int64_t& operator[](int lane) { return reinterpret_cast<std::int64_t*>(this)[lane]; }

  // Arithmetic as for doubles.
  /// \cond arithmetic
  SHAKER_INLINE friend LaneMask operator&(const LaneMask& a, const LaneMask& b) {
    return {a.low & b.low, a.high & b.high};
  }
  SHAKER_INLINE friend LaneMask operator|(const LaneMask& a, const LaneMask& b) {
    return {a.low | b.low, a.high | b.high};
  }
  SHAKER_INLINE friend LaneMask operator^(const LaneMask& a, const LaneMask& b) {
    return {a.low ^ b.low, a.high ^ b.high};
  }
  SHAKER_INLINE friend LaneMask operator~(const LaneMask& a) { return {~a.low, ~a.high}; }
  SHAKER_INLINE LaneMask& operator&=(const LaneMask& b) { return *this = *this & b; }
  SHAKER_INLINE LaneMask& operator|=(const LaneMask& b) { return *this = *this | b; }
  /// \endcond
};

/// Eight doubles.
struct alignas(64) Lanes {
  /// Lanes 0 to 3 and 4 to 7.
  /// @{
  HalfLanes low, high;
  /// @}

  /// Not initialised; Lanes{} has zeros.
  Lanes() = default;
  /// \param all value of each lane
  SHAKER_INLINE Lanes(double all)  // NOLINT: the same in all lanes
      : low{all, all, all, all}, high{all, all, all, all} {}
  /// \param l lanes 0 to 3
  /// \param h lanes 4 to 7
  SHAKER_INLINE Lanes(const HalfLanes& l, const HalfLanes& h) : low(l), high(h) {}

  /// \param lane 0 to 7
  /// \return the value of the lane
  SHAKER_INLINE double& operator[](int lane) { return reinterpret_cast<double*>(this)[lane]; }
  /// \param lane 0 to 7
  /// \return the value of the lane
  SHAKER_INLINE double operator[](int lane) const {
    return reinterpret_cast<const double*>(this)[lane];
  }

  // Arithmetic as for doubles.
  /// \cond arithmetic
  SHAKER_INLINE friend Lanes operator-(const Lanes& a) { return {-a.low, -a.high}; }
  SHAKER_INLINE friend Lanes operator+(const Lanes& a, const Lanes& b) {
    return {a.low + b.low, a.high + b.high};
  }
  SHAKER_INLINE friend Lanes operator-(const Lanes& a, const Lanes& b) {
    return {a.low - b.low, a.high - b.high};
  }
  SHAKER_INLINE friend Lanes operator*(const Lanes& a, const Lanes& b) {
    return {a.low * b.low, a.high * b.high};
  }
  SHAKER_INLINE friend Lanes operator/(const Lanes& a, const Lanes& b) {
    return {a.low / b.low, a.high / b.high};
  }
  SHAKER_INLINE Lanes& operator+=(const Lanes& b) { return *this = *this + b; }
  SHAKER_INLINE Lanes& operator-=(const Lanes& b) { return *this = *this - b; }
  SHAKER_INLINE Lanes& operator*=(const Lanes& b) { return *this = *this * b; }

  SHAKER_INLINE friend LaneMask operator<(const Lanes& a, const Lanes& b) {
    return {a.low < b.low, a.high < b.high};
  }
  SHAKER_INLINE friend LaneMask operator>(const Lanes& a, const Lanes& b) { return b < a; }
  SHAKER_INLINE friend LaneMask operator<=(const Lanes& a, const Lanes& b) {
    return {a.low <= b.low, a.high <= b.high};
  }
  SHAKER_INLINE friend LaneMask operator>=(const Lanes& a, const Lanes& b) { return b <= a; }
  SHAKER_INLINE friend LaneMask operator==(const Lanes& a, const Lanes& b) {
    return {a.low == b.low, a.high == b.high};
  }
  /// \endcond
};

/// Selects in each lane `one` where the mask is set, otherwise `other`.
/// \param first the mask
/// \param one taken where it is set
/// \param other taken elsewhere
/// \return the selection
SHAKER_INLINE Lanes chosen(const LaneMask& first, const Lanes& one, const Lanes& other) {
  return {first.low ? one.low : other.low, first.high ? one.high : other.high};
}
/// Absolute value in each lane.
/// \param x argument
/// \return the values
SHAKER_INLINE Lanes magnitude(const Lanes& x) {
  return chosen(x < 0.0, -x, x);
}

/// Natural logarithm in each lane.
/// \param x positive, finite and normal
/// \param out receives the logarithms
SHAKER_INLINE void fast_log(const Lanes& x, Lanes& out) {
  logarithm_of<HalfLanes, HalfBits>(x.low, out.low);
  logarithm_of<HalfLanes, HalfBits>(x.high, out.high);
}
/// Exponential in each lane.
/// \param x of a magnitude below 700
/// \param out receives the exponentials
SHAKER_INLINE void fast_exp(const Lanes& x, Lanes& out) {
  exponential_of<HalfLanes, HalfBits>(x.low, out.low);
  exponential_of<HalfLanes, HalfBits>(x.high, out.high);
}

/// Access in batches of eight to an array of doubles on a 64-byte boundary.
/// \param p first double, on a 64-byte boundary
/// \return the first batch
inline Lanes* as_lanes(double* p) {
  return reinterpret_cast<Lanes*>(p);
}
/// \param p first double, on a 64-byte boundary
/// \return the first batch
inline const Lanes* as_lanes(const double* p) {
  return reinterpret_cast<const Lanes*>(p);
}

/// Sets lanes that are infinite or NaN to 0.
/// \param x the batch to change
SHAKER_INLINE void keep_finite(Lanes& x) {
  x = chosen(x - x == 0.0, x, Lanes{});
}

/// Keeps the largest magnitude so far in each lane; NaN is ignored.
/// \param largest magnitudes so far
/// \param value the next batch
SHAKER_INLINE void keep_largest(Lanes& largest, const Lanes& value) {
  const Lanes size = magnitude(value);
  largest = chosen(size > largest, size, largest);
}

/// Bit l of the result is lane l of the mask.
/// \param mask a mask
/// \return its bits
SHAKER_INLINE unsigned bits_of(const LaneMask& mask) {
  const HalfMask bit = {1, 2, 4, 8};
  HalfMask bits = (mask.low & bit) | ((mask.high & bit) << 4);
  bits |= __builtin_shufflevector(bits, bits, 2, 3, 0, 1);
  bits |= __builtin_shufflevector(bits, bits, 1, 0, 3, 2);
  return static_cast<unsigned>(bits[0]);
}
/// The inverse of bits_of().
/// \param bits bit l: lane l
/// \return the mask
SHAKER_INLINE LaneMask mask_of(unsigned bits) {
  const HalfMask bit = {1, 2, 4, 8};
  const auto all = static_cast<std::int64_t>(bits);
  const HalfMask wanted = {all, all, all, all};
  return {(wanted & bit) != 0, (wanted & (bit << 4)) != 0};
}
/// The lanes from `first` to `last`; both may lie outside 0 to 7.
/// \param first lane
/// \param last lane
/// \return the mask
SHAKER_INLINE LaneMask lanes_between(int first, int last) {
  const HalfMask low = {0, 1, 2, 3}, high = {4, 5, 6, 7};
  return {(low >= first) & (low <= last), (high >= first) & (high <= last)};
}

/// Transposes four rows of four lanes.
/// \param a row 0
/// \param b row 1
/// \param c row 2
/// \param d row 3
SHAKER_INLINE void transpose(HalfLanes& a, HalfLanes& b, HalfLanes& c, HalfLanes& d) {
  const HalfLanes ab0 = __builtin_shufflevector(a, b, 0, 4, 2, 6);
  const HalfLanes ab1 = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const HalfLanes cd0 = __builtin_shufflevector(c, d, 0, 4, 2, 6);
  const HalfLanes cd1 = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  a = __builtin_shufflevector(ab0, cd0, 0, 1, 4, 5);
  b = __builtin_shufflevector(ab1, cd1, 0, 1, 4, 5);
  c = __builtin_shufflevector(ab0, cd0, 2, 3, 6, 7);
  d = __builtin_shufflevector(ab1, cd1, 2, 3, 6, 7);
}

/// Transposes eight rows of eight lanes, by quarters.
/// \param m the rows
SHAKER_INLINE void transpose(Lanes (&m)[kLanes]) {
  transpose(m[0].low, m[1].low, m[2].low, m[3].low);
  transpose(m[0].high, m[1].high, m[2].high, m[3].high);
  transpose(m[4].low, m[5].low, m[6].low, m[7].low);
  transpose(m[4].high, m[5].high, m[6].high, m[7].high);
  for (int l = 0; l < kLanes / 2; ++l) {
    const HalfLanes upper = m[l].high;
    m[l].high = m[l + 4].low;
    m[l + 4].low = upper;
  }
}

}  // namespace shaker::estimator
