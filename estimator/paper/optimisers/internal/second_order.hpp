// Automatic differentiation: a number with its gradient and Hessian over N parameters (a
// second-order Taylor polynomial, hyper-dual in all directions). It gives exact first and second
// derivatives of any formula, for any scalar type.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace shaker::estimator::optimisers {

template <class T, std::size_t N>
struct SecondOrder {
  static constexpr std::size_t kHessian = N * (N + 1) / 2;
  T value{};
  std::array<T, N> gradient{};
  std::array<T, kHessian> hessian{};  // lower triangle, row by row

  SecondOrder() { fill(); }
  SecondOrder(const T& v) : value(v) { fill(); }  // NOLINT: a constant, as in formulas
  static SecondOrder parameter(const T& v, std::size_t index) {
    SecondOrder x(v);
    x.gradient[index] = T(1);
    return x;
  }
  // f(x) from its value and first two derivatives at x.
  SecondOrder chain(const T& f, const T& f1, const T& f2) const {
    SecondOrder out(f);
    std::size_t h = 0;
    for (std::size_t k = 0; k < N; ++k) {
      out.gradient[k] = f1 * gradient[k];
      for (std::size_t l = 0; l <= k; ++l, ++h)
        out.hessian[h] = f1 * hessian[h] + f2 * gradient[k] * gradient[l];
    }
    return out;
  }

 private:
  void fill() {
    gradient.fill(T(0));
    hessian.fill(T(0));
  }
};

template <class T, std::size_t N>
SecondOrder<T, N> operator+(SecondOrder<T, N> a, const SecondOrder<T, N>& b) {
  a.value += b.value;
  for (std::size_t k = 0; k < N; ++k)
    a.gradient[k] += b.gradient[k];
  for (std::size_t k = 0; k < a.kHessian; ++k)
    a.hessian[k] += b.hessian[k];
  return a;
}
template <class T, std::size_t N>
SecondOrder<T, N> operator-(const SecondOrder<T, N>& a) {
  return a.chain(-a.value, T(-1), T(0));
}
template <class T, std::size_t N>
SecondOrder<T, N> operator-(const SecondOrder<T, N>& a, const SecondOrder<T, N>& b) {
  return a + (-b);
}
template <class T, std::size_t N>
SecondOrder<T, N> operator*(const SecondOrder<T, N>& a, const SecondOrder<T, N>& b) {
  SecondOrder<T, N> out(a.value * b.value);
  std::size_t h = 0;
  for (std::size_t k = 0; k < N; ++k) {
    out.gradient[k] = a.value * b.gradient[k] + b.value * a.gradient[k];
    for (std::size_t l = 0; l <= k; ++l, ++h)
      out.hessian[h] = a.value * b.hessian[h] + b.value * a.hessian[h] +
                       a.gradient[k] * b.gradient[l] + b.gradient[k] * a.gradient[l];
  }
  return out;
}
template <class T, std::size_t N>
SecondOrder<T, N> inverse(const SecondOrder<T, N>& a) {
  const T i = T(1) / a.value;
  return a.chain(i, -i * i, T(2) * i * i * i);
}
template <class T, std::size_t N>
SecondOrder<T, N> operator/(const SecondOrder<T, N>& a, const SecondOrder<T, N>& b) {
  return a * inverse(b);
}

#define SHAKER_MIXED(op)                                                  \
  template <class T, std::size_t N>                                       \
  SecondOrder<T, N> operator op(const SecondOrder<T, N>& a, const T& b) { \
    return a op SecondOrder<T, N>(b);                                     \
  }                                                                       \
  template <class T, std::size_t N>                                       \
  SecondOrder<T, N> operator op(const T& a, const SecondOrder<T, N>& b) { \
    return SecondOrder<T, N>(a) op b;                                     \
  }
SHAKER_MIXED(+)
SHAKER_MIXED(-)
SHAKER_MIXED(*)
SHAKER_MIXED(/)
#undef SHAKER_MIXED

template <class T, std::size_t N>
SecondOrder<T, N> exp(const SecondOrder<T, N>& a) {
  using std::exp;
  const T e = exp(a.value);
  return a.chain(e, e, e);
}
template <class T, std::size_t N>
SecondOrder<T, N> log(const SecondOrder<T, N>& a) {
  using std::log;
  const T i = T(1) / a.value;
  return a.chain(log(a.value), i, -i * i);
}
template <class T, std::size_t N>
SecondOrder<T, N> sin(const SecondOrder<T, N>& a) {
  using std::cos;
  using std::sin;
  const T s = sin(a.value);
  return a.chain(s, cos(a.value), -s);
}
template <class T, std::size_t N>
SecondOrder<T, N> cos(const SecondOrder<T, N>& a) {
  using std::cos;
  using std::sin;
  const T c = cos(a.value);
  return a.chain(c, -sin(a.value), -c);
}
template <class T, std::size_t N>
SecondOrder<T, N> atan(const SecondOrder<T, N>& a) {
  using std::atan;
  const T d = T(1) / (T(1) + a.value * a.value);
  return a.chain(atan(a.value), d, T(-2) * a.value * d * d);
}
// For a positive base.
template <class T, std::size_t N>
SecondOrder<T, N> pow(const SecondOrder<T, N>& a, const SecondOrder<T, N>& b) {
  return exp(b * log(a));
}

}  // namespace shaker::estimator::optimisers
