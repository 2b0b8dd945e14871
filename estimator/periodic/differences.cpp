// Velocity and acceleration of the state over the cyclic time.
#include <algorithm>
#include <array>

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
  for (int c = 0; c < s_; ++c) {
    const Stencil& stencil = stencil_of(c);
    for (int k = 0; k <= 2 * reach; ++k) {
      first[k] = stencil.first[k] * f1;
      second[k] = stencil.second[k] * f1 * f1;
    }
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

}  // namespace shaker::estimator
