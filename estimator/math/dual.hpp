// A number with its N partial derivatives. The chain rule carries them through a formula:
// forward automatic differentiation, exact to rounding. For effects whose computing time
// matters less than that of the base model, whose derivatives are written by hand.
#pragma once

#include <cmath>

#include "estimator/math/simd_math.hpp"

namespace shaker::estimator {

template <int N>
struct Dual {
  // Rounded up to whole registers where loops are compiled for them.
  static constexpr int kStored = N <= 2 || !SHAKER_HAS_SIMD_CLONES ? N : (N + 3) / 4 * 4;
  double value = 0.0;
  double d[kStored] = {};

  Dual() = default;
  Dual(double v) : value(v) {}  // NOLINT: constants convert
  Dual(double v, int variable) : value(v) { d[variable] = 1.0; }

  // The result of f: its value, and its derivative `slope` at this value.
  Dual chained(double f, double slope) const {
    Dual r(f);
    for (int k = 0; k < kStored; ++k)
      r.d[k] = slope * d[k];
    return r;
  }
  Dual& operator+=(const Dual& o) { return *this = *this + o; }
  Dual& operator-=(const Dual& o) { return *this = *this - o; }
  Dual& operator*=(const Dual& o) { return *this = *this * o; }

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
};

template <int N>
Dual<N> sqrt(const Dual<N>& x) {
  const double root = std::sqrt(x.value);
  return x.chained(root, 0.5 / root);
}
template <int N>
Dual<N> exp(const Dual<N>& x) {
  const double e = std::exp(x.value);
  return x.chained(e, e);
}
template <int N>
Dual<N> log(const Dual<N>& x) {
  return x.chained(std::log(x.value), 1.0 / x.value);
}
template <int N>
Dual<N> tanh(const Dual<N>& x) {
  const double t = std::tanh(x.value);
  return x.chained(t, 1.0 - t * t);
}
template <int N>
Dual<N> sin(const Dual<N>& x) {
  return x.chained(std::sin(x.value), std::cos(x.value));
}
template <int N>
Dual<N> cos(const Dual<N>& x) {
  return x.chained(std::cos(x.value), -std::sin(x.value));
}
template <int N>
Dual<N> abs(const Dual<N>& x) {
  return x.value < 0.0 ? -x : x;
}
// The base must be positive.
template <int N>
Dual<N> pow(const Dual<N>& base, const Dual<N>& exponent) {
  return exp(exponent * log(base));
}

// Smoothed functions of the effects' formulas, for plain doubles as well.
template <class T>
T square(const T& x) {
  return x * x;
}
// |x|_e = sqrt(x^2 + e^2).
template <class T>
T smooth_abs(const T& x, double e) {
  using std::sqrt;
  return sqrt(x * x + e * e);
}
// H_w(x) = 1 / (1 + exp(-x / w)), computed from e = exp(-|x| / w).
inline double smooth_step_of(double e, bool above) {
  return (above ? 1.0 : e) / (1.0 + e);
}
inline double smooth_step(double x, double w) {
  return smooth_step_of(std::exp(-std::fabs(x) / w), x > 0.0);
}
template <int N>
Dual<N> smooth_step(const Dual<N>& x, double w) {
  const double e = std::exp(-std::fabs(x.value) / w);
  return x.chained(smooth_step_of(e, x.value > 0.0), e / (w * (1.0 + e) * (1.0 + e)));
}
// sp_w(x) = max(x, 0) + w log(1 + exp(-|x| / w)); its derivative is H_w.
inline double smooth_ramp(double x, double w) {
  return std::fmax(x, 0.0) + w * std::log1p(std::exp(-std::fabs(x) / w));
}
template <int N>
Dual<N> smooth_ramp(const Dual<N>& x, double w) {
  const double e = std::exp(-std::fabs(x.value) / w);
  return x.chained(std::fmax(x.value, 0.0) + w * std::log1p(e), smooth_step_of(e, x.value > 0.0));
}

}  // namespace shaker::estimator
