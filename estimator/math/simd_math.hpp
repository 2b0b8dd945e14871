/// \file
/// Logarithm and exponential that the compiler can vectorise, and macros that build one loop for
/// several instruction sets.
///
/// A periodic solution evaluates the gas force at every point of the period. With scalar calls
/// of libm this takes two thirds of the time of an estimate. These are branch-free series on the
/// reduced argument (atanh series for the logarithm, Taylor for the exponential), within 2 ulp
/// of libm on the range that the models use (tests/estimator/simd_math_test). They do not treat
/// special values: the caller must ensure positive and finite arguments.
#pragma once

#include <bit>
#include <cstdint>

/// Compiles the following loop once for each instruction set; the loader selects one at program
/// start. Not with sanitizers, which do not work with the indirect functions of the loader. A build
/// for one instruction set (cmake -DSHAKER_INSTRUCTION_SET) compiles them for that one only.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#ifdef SHAKER_INSTRUCTION_SET
#define SHAKER_SIMD_CLONES __attribute__((target(SHAKER_INSTRUCTION_SET)))
#else
#define SHAKER_SIMD_CLONES \
  __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#endif
#define SHAKER_HAS_SIMD_CLONES true
#else
#define SHAKER_SIMD_CLONES
/// Whether SHAKER_SIMD_CLONES does anything.
#define SHAKER_HAS_SIMD_CLONES false
#endif
/// A function that is inlined into a loop under SHAKER_SIMD_CLONES.
#define SHAKER_INLINE __attribute__((always_inline)) inline

namespace shaker::estimator {

/// Real is double with Bits = std::uint64_t, or vectors of both.
/// Precondition: x positive, finite and normal.
/// \param x argument
/// \param out receives the natural logarithm
template <class Real, class Bits>
SHAKER_INLINE void logarithm_of(const Real& x, Real& out) {
  // x = 2^k m with m in [sqrt(1/2), sqrt(2)).
  constexpr std::uint64_t kSqrtHalf = 0x3fe6a09e667f3bcdULL;
  const Bits bits = __builtin_bit_cast(Bits, x);
  const Bits shifted = bits - kSqrtHalf;
  const Real m = __builtin_bit_cast(Real, bits - (shifted & 0xfff0000000000000ULL));
  // Converts the integer to double without a conversion instruction: the bits of
  // 2^52 + (k mod 4096).
  const Real wrapped =
      __builtin_bit_cast(Real, (shifted >> 52) | 0x4330000000000000ULL) - 4503599627370496.0;
  const Real k = wrapped >= 2048.0 ? wrapped - 4096.0 : wrapped;
  const Real s = (m - 1.0) / (m + 1.0);
  const Real q = s * s;
  Real p = q * (1.0 / 23.0) + 1.0 / 21.0;
  p = p * q + 1.0 / 19.0;
  p = p * q + 1.0 / 17.0;
  p = p * q + 1.0 / 15.0;
  p = p * q + 1.0 / 13.0;
  p = p * q + 1.0 / 11.0;
  p = p * q + 1.0 / 9.0;
  p = p * q + 1.0 / 7.0;
  p = p * q + 1.0 / 5.0;
  p = p * q + 1.0 / 3.0;
  constexpr double kLn2High = 6.93147180369123816490e-01;
  constexpr double kLn2Low = 1.90821492927058770002e-10;
  out = k * kLn2High + (2.0 * s + (2.0 * s * q * p + k * kLn2Low));
}

/// Precondition: |x| < 700.
/// \param x exponent
/// \param out receives the exponential
template <class Real, class Bits>
SHAKER_INLINE void exponential_of(const Real& x, Real& out) {
  constexpr double kLog2e = 1.44269504088896340736;
  constexpr double kLn2High = 6.93147180369123816490e-01;
  constexpr double kLn2Low = 1.90821492927058770002e-10;
  constexpr double kRound = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to an integer
  const Real shifted = x * kLog2e + kRound;
  const Real k = shifted - kRound;
  const Real r = (x - k * kLn2High) - k * kLn2Low;
  Real p = r * (1.0 / 6227020800.0) + 1.0 / 479001600.0;
  p = p * r + 1.0 / 39916800.0;
  p = p * r + 1.0 / 3628800.0;
  p = p * r + 1.0 / 362880.0;
  p = p * r + 1.0 / 40320.0;
  p = p * r + 1.0 / 5040.0;
  p = p * r + 1.0 / 720.0;
  p = p * r + 1.0 / 120.0;
  p = p * r + 1.0 / 24.0;
  p = p * r + 1.0 / 6.0;
  p = p * r + 0.5;
  p = p * r + 1.0;
  p = p * r + 1.0;
  const Bits scale = (__builtin_bit_cast(Bits, shifted) + 1023) << 52;
  out = p * __builtin_bit_cast(Real, scale);
}

/// Natural logarithm.
/// \param x positive, finite and normal
/// \return the logarithm
SHAKER_INLINE double fast_log(double x) {
  double out;
  logarithm_of<double, std::uint64_t>(x, out);
  return out;
}

/// Exponential.
/// \param x of a magnitude below 700
/// \return the exponential
SHAKER_INLINE double fast_exp(double x) {
  double out;
  exponential_of<double, std::uint64_t>(x, out);
  return out;
}

}  // namespace shaker::estimator
