#include "estimator/solve/periodic/internal/differences.hpp"

#include <algorithm>
#include <array>

#include "estimator/math/simd_math.hpp"
#include "estimator/solve/periodic/internal/dense.hpp"

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

void take_differences(const Stencil& stencil, double rate, int n, double* u, double* v, double* a) {
  const int reach = stencil.reach;
  double first[8] = {};
  double second[8] = {};
  for (int k = 0; k <= 2 * reach; ++k) {
    first[k] = stencil.first[static_cast<std::size_t>(k)] * rate;
    second[k] = stencil.second[static_cast<std::size_t>(k)] * rate * rate;
  }
  for (int k = 1; k <= reach; ++k) {
    u[-k] = u[n - k];
    u[n - 1 + k] = u[k - 1];
  }
  kDifference[static_cast<std::size_t>(reach - 1)](n, u - reach, first, second, v, a);
}

void PeriodicSystem::differentiate() {
  if (dense_) return differentiate_fourier();
  for (int c = 0; c < s_; ++c) {
    double* u = u_[c];
    if (s_ == 1)
      std::copy_n(z_.begin(), n_, u);
    else
      for (int i = 0; i < n_; ++i)
        u[i] = z_[i * s_ + c];
    take_differences(stencil_of(c), frequency_ * n_, n_, u, v_[c], a_[c]);
    for (int i = n_; i < padded_; ++i)
      u[i] = u[n_ - 1];  // admissible values in the padding too
  }
}

}  // namespace shaker::estimator
