// Velocity and acceleration of the state over the cyclic time, and their correction at the kinks.
#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Dense>

#include "estimator/math/simd_math.hpp"
#include "estimator/periodic/dense.hpp"

namespace shaker::estimator {
namespace {

template <int Reach>
SHAKER_INLINE void difference(int n, const double* __restrict padded,
                              const double* __restrict first, const double* __restrict second,
                              double* __restrict v, double* __restrict a) {
  for (int i = 0; i < n; ++i) {
    double dv = 0.0;
    double da = 0.0;
    for (int k = 0; k <= 2 * Reach; ++k) {
      dv += first[k] * padded[i + k];
      da += second[k] * padded[i + k];
    }
    v[i] = dv;
    a[i] = da;
  }
}

SHAKER_SIMD_CLONES void difference_1(int n, const double* u, const double* first,
                                     const double* second, double* v, double* a) {
  difference<1>(n, u, first, second, v, a);
}
SHAKER_SIMD_CLONES void difference_2(int n, const double* u, const double* first,
                                     const double* second, double* v, double* a) {
  difference<2>(n, u, first, second, v, a);
}
SHAKER_SIMD_CLONES void difference_3(int n, const double* u, const double* first,
                                     const double* second, double* v, double* a) {
  difference<3>(n, u, first, second, v, a);
}
constexpr auto kDifference = std::array{difference_1, difference_2, difference_3};

}  // namespace

void PeriodicSystem::differentiate() {
  if (dense_) return differentiate_fourier();
  const int reach = stencil_.reach;
  double first[8] = {};
  double second[8] = {};
  const double f1 = frequency_ * n_;
  for (int k = 0; k <= 2 * reach; ++k) {
    first[k] = stencil_.first[k] * f1;
    second[k] = stencil_.second[k] * f1 * f1;
  }
  for (int c = 0; c < s_; ++c) {
    double* u = u_[c];
    for (int i = 0; i < n_; ++i)
      u[i] = z_[i * s_ + c];
    for (int k = 1; k <= reach; ++k) {
      u[-k] = u[n_ - k];
      u[n_ - 1 + k] = u[k - 1];
    }
    kDifference[static_cast<std::size_t>(reach - 1)](n_, u - reach, first, second, v_[c], a_[c]);
    for (int i = n_; i < padded_; ++i)
      u[i] = u[n_ - 1];  // no wild values in the padding
  }
}

void PeriodicSystem::differentiate_fourier() {
  for (int c = 0; c < s_; ++c) {
    for (int i = 0; i < n_; ++i)
      u_[c][i] = z_[i * s_ + c];
    const Eigen::Map<const Eigen::VectorXd> u(u_[c], n_);
    Eigen::Map<Eigen::VectorXd>(v_[c], n_).noalias() = frequency_ * (dense_->first * u);
    Eigen::Map<Eigen::VectorXd>(a_[c], n_).noalias() =
        frequency_ * frequency_ * (dense_->second * u);
  }
}

// At a zero t* of the velocity the force's second derivative over v jumps by `kink`, so that
//   [u'''' ] = -kink a |a|,   [u^(5)] = -3 kink |a| j      (a, j: acceleration, jerk at t*).
// A stencil that straddles t* is taken on the smooth continuation of its own side: the neighbours
// on the other side are shifted by the jump's Taylor terms.
void PeriodicSystem::correct_kinks(double kink) {
  const int reach = stencil_.reach;
  const double h = 1.0 / (frequency_ * n_);
  double* v = v_[0];
  double* a = a_[0];
  double crossing[16];
  double jump4[16];
  double jump5[16];
  int count = 0;
  for (int i = 0; i < n_ && count < 16; ++i) {
    const int next = i + 1 == n_ ? 0 : i + 1;
    if ((v[i] < 0.0) == (v[next] < 0.0)) continue;
    // Hermite cubic of v through v, a at both ends; two Newton steps from the secant.
    const double d = v[next] - v[i];
    const double m0 = h * a[i];
    const double m1 = h * a[next];
    double t = -v[i] / d;
    for (int it = 0; it < 2; ++it) {
      const double c2 = 3.0 * d - 2.0 * m0 - m1;
      const double c3 = m0 + m1 - 2.0 * d;
      const double value = v[i] + t * (m0 + t * (c2 + t * c3));
      const double slope = m0 + t * (2.0 * c2 + 3.0 * t * c3);
      if (slope != 0.0) t -= value / slope;
    }
    t = std::clamp(t, 0.0, 1.0);
    const double acceleration = a[i] + t * (a[next] - a[i]);
    const double jerk = (a[next] - a[i]) / h;
    crossing[count] = i + t;
    jump4[count] = -kink * acceleration * std::fabs(acceleration) / 24.0;
    jump5[count] = -3.0 * kink * std::fabs(acceleration) * jerk / 120.0;
    ++count;
  }
  const double f1 = frequency_ * n_;
  for (int c = 0; c < count; ++c) {
    const int base = static_cast<int>(crossing[c]);
    for (int i = base - reach + 1; i <= base + reach; ++i) {
      double dv = 0.0;
      double da = 0.0;
      for (int k = -reach; k <= reach; ++k) {
        const bool here = i <= base;       // this point is before the crossing
        const bool there = i + k <= base;  // so is the neighbour
        if (here == there) continue;
        const double distance = (i + k - crossing[c]) * h;
        const double d4 = distance * distance * distance * distance;
        const double shift = (jump4[c] + jump5[c] * distance) * d4;
        const double signed_shift = here ? -shift : shift;
        dv += stencil_.first[k + reach] * signed_shift;
        da += stencil_.second[k + reach] * signed_shift;
      }
      const int at = (i + n_) % n_;
      v[at] += f1 * dv;
      a[at] += f1 * f1 * da;
    }
  }
}

}  // namespace shaker::estimator
