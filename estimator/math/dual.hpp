/// \file
/// A number with its N partial derivatives. The chain rule carries them through a formula:
/// forward automatic differentiation, exact to rounding. For effects whose computing time
/// matters less than that of the base model, whose derivatives are written by hand.
#pragma once

#include <cmath>

#include "estimator/math/simd_math.hpp"

namespace shaker::estimator {

/// A value and its derivatives over N variables.
template <int N>
struct Dual {
  /// Rounded up to whole registers where loops are compiled for them.
  static constexpr int kStored = N <= 2 || !SHAKER_HAS_SIMD_CLONES ? N : (N + 3) / 4 * 4;
  double value = 0.0;      ///< the value
  double d[kStored] = {};  ///< the derivatives; those from N on are 0

  /// Zero.
  Dual() = default;
  /// \param v a constant
  Dual(double v) : value(v) {}  // NOLINT: constants convert
  /// \param v value of a variable
  /// \param variable its index, below N
  Dual(double v, int variable) : value(v) { d[variable] = 1.0; }

  /// The result of f: its value, and its derivative `slope` at this value.
  /// \param f value of the function
  /// \param slope its derivative
  /// \return the result
  Dual chained(double f, double slope) const {
    Dual r(f);
    for (int k = 0; k < kStored; ++k)
      r.d[k] = slope * d[k];
    return r;
  }
  /// \param o summand
  /// \return this number
  Dual& operator+=(const Dual& o) { return *this = *this + o; }
  /// \param o subtrahend
  /// \return this number
  Dual& operator-=(const Dual& o) { return *this = *this - o; }
  /// \param o factor
  /// \return this number
  Dual& operator*=(const Dual& o) { return *this = *this * o; }

  // Arithmetic as for doubles.
  /// \cond arithmetic
  friend Dual operator-(const Dual& a) { return a.chained(-a.value, -1.0); }
  friend Dual operator+(const Dual& a, const Dual& b) {
    Dual r(a.value + b.value);
    for (int k = 0; k < kStored; ++k)
      r.d[k] = a.d[k] + b.d[k];
    return r;
  }
  friend Dual operator-(const Dual& a, const Dual& b) {
    Dual r(a.value - b.value);
    for (int k = 0; k < kStored; ++k)
      r.d[k] = a.d[k] - b.d[k];
    return r;
  }
  friend Dual operator*(const Dual& a, const Dual& b) {
    Dual r(a.value * b.value);
    for (int k = 0; k < kStored; ++k)
      r.d[k] = a.d[k] * b.value + a.value * b.d[k];
    return r;
  }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const double over = 1.0 / b.value;
    Dual r(a.value * over);
    for (int k = 0; k < kStored; ++k)
      r.d[k] = (a.d[k] - r.value * b.d[k]) * over;
    return r;
  }
  friend Dual operator+(const Dual& a, double b) { return a.chained(a.value + b, 1.0); }
  friend Dual operator+(double a, const Dual& b) { return b.chained(a + b.value, 1.0); }
  friend Dual operator-(const Dual& a, double b) { return a.chained(a.value - b, 1.0); }
  friend Dual operator-(double a, const Dual& b) { return b.chained(a - b.value, -1.0); }
  friend Dual operator*(const Dual& a, double b) { return a.chained(a.value * b, b); }
  friend Dual operator*(double a, const Dual& b) { return b.chained(a * b.value, a); }
  friend Dual operator/(const Dual& a, double b) { return a.chained(a.value / b, 1.0 / b); }
  /// \endcond
};

/// Square root.
/// \param x above 0
/// \return the root
template <int N>
Dual<N> sqrt(const Dual<N>& x) {
  const double root = std::sqrt(x.value);
  return x.chained(root, 0.5 / root);
}
/// Exponential.
/// \param x exponent
/// \return e to the x
template <int N>
Dual<N> exp(const Dual<N>& x) {
  const double e = std::exp(x.value);
  return x.chained(e, e);
}
/// Natural logarithm.
/// \param x above 0
/// \return the logarithm
template <int N>
Dual<N> log(const Dual<N>& x) {
  return x.chained(std::log(x.value), 1.0 / x.value);
}
/// Hyperbolic tangent.
/// \param x argument
/// \return the tangent
template <int N>
Dual<N> tanh(const Dual<N>& x) {
  const double t = std::tanh(x.value);
  return x.chained(t, 1.0 - t * t);
}
/// Sine.
/// \param x angle, rad
/// \return the sine
template <int N>
Dual<N> sin(const Dual<N>& x) {
  return x.chained(std::sin(x.value), std::cos(x.value));
}
/// Cosine.
/// \param x angle, rad
/// \return the cosine
template <int N>
Dual<N> cos(const Dual<N>& x) {
  return x.chained(std::cos(x.value), -std::sin(x.value));
}
/// Absolute value.
/// \param x argument
/// \return the value
template <int N>
Dual<N> abs(const Dual<N>& x) {
  return x.value < 0.0 ? -x : x;
}
/// Power.
/// \param base above 0
/// \param exponent any
/// \return base to the exponent
template <int N>
Dual<N> pow(const Dual<N>& base, const Dual<N>& exponent) {
  return exp(exponent * log(base));
}

// Smoothed functions of the effects' formulas, for plain doubles as well.

/// Square.
/// \param x argument
/// \return x squared
template <class T>
T square(const T& x) {
  return x * x;
}
/// |x|_e = sqrt(x^2 + e^2).
/// \param x argument
/// \param e width of the rounding, above 0
/// \return the rounded absolute value
template <class T>
T smooth_abs(const T& x, double e) {
  using std::sqrt;
  return sqrt(x * x + e * e);
}
/// H_w(x) = 1 / (1 + exp(-x / w)), computed from e = exp(-|x| / w).
/// \param e the exponential above
/// \param above true: x is positive
/// \return H_w(x)
inline double smooth_step_of(double e, bool above) {
  return (above ? 1.0 : e) / (1.0 + e);
}
/// H_w(x).
/// \param x argument
/// \param w width, above 0
/// \return H_w(x)
inline double smooth_step(double x, double w) {
  return smooth_step_of(std::exp(-std::fabs(x) / w), x > 0.0);
}
/// H_w(x).
/// \param x argument
/// \param w width, above 0
/// \return H_w(x)
template <int N>
Dual<N> smooth_step(const Dual<N>& x, double w) {
  const double e = std::exp(-std::fabs(x.value) / w);
  return x.chained(smooth_step_of(e, x.value > 0.0), e / (w * (1.0 + e) * (1.0 + e)));
}
/// sp_w(x) = max(x, 0) + w log(1 + exp(-|x| / w)); its derivative is H_w.
/// \param x argument
/// \param w width, above 0
/// \return sp_w(x)
inline double smooth_ramp(double x, double w) {
  return std::fmax(x, 0.0) + w * std::log1p(std::exp(-std::fabs(x) / w));
}
/// sp_w(x).
/// \param x argument
/// \param w width, above 0
/// \return sp_w(x)
template <int N>
Dual<N> smooth_ramp(const Dual<N>& x, double w) {
  const double e = std::exp(-std::fabs(x.value) / w);
  return x.chained(std::fmax(x.value, 0.0) + w * std::log1p(e), smooth_step_of(e, x.value > 0.0));
}

}  // namespace shaker::estimator
