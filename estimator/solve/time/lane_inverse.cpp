#include "estimator/solve/time/internal/lane_inverse.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/math/simd_math.hpp"

namespace shaker::estimator {
namespace {

constexpr double kPivot = 1e-5;      // smallest pivot without an exchange, over the others' size
constexpr double kSingular = 1e-14;  // smallest pivot, relative to the matrix's largest entry

std::size_t at(int i) {
  return static_cast<std::size_t>(i);
}

// False where a pivot is too small beside an entry of its column.
SHAKER_SIMD_CLONES bool exceeds(int n, const double* __restrict pivot,
                                const double* __restrict below) {
  int small = 0;
  for (int i = 0; i < n; ++i)
    small += std::fabs(pivot[i]) >= kPivot * std::fabs(below[i]) ? 0 : 1;
  return small == 0;
}

// False where one is 0.
SHAKER_SIMD_CLONES bool reciprocals(int n, double* __restrict x) {
  int none = 0;
  for (int i = 0; i < n; ++i) {
    none += x[i] == 0.0 ? 1 : 0;
    x[i] = 1.0 / x[i];
  }
  return none == 0;
}

// x *= sign y
SHAKER_SIMD_CLONES void scale(int n, double sign, const double* __restrict y,
                              double* __restrict x) {
  for (int i = 0; i < n; ++i)
    x[i] *= sign * y[i];
}

// z += sign x y
SHAKER_SIMD_CLONES void add_product(int n, double sign, const double* __restrict x,
                                    const double* __restrict y, double* __restrict z) {
  for (int i = 0; i < n; ++i)
    z[i] += sign * x[i] * y[i];
}

}  // namespace

void LaneInverse::shape(int n, int size) {
  const std::size_t stride = (at(n) + 7) / 8 * 8;
  if (size == size_ && stride <= stride_) return;
  size_ = size;
  stride_ = stride;
  entries_.assign(at(size * size) * stride, 0.0);
  kept_ = entries_;
  matrix_.resize(at(size * size));
  column_.resize(at(size));
  pivot_.resize(at(size));
}

bool LaneInverse::invert(int n) {
  std::copy(entries_.begin(), entries_.end(), kept_.begin());
  if (eliminate(n)) return true;
  for (int lane = 0; lane < n; ++lane) {
    if (!factor(lane)) return false;
    for (int k = 0; k < size_; ++k) {
      std::fill(column_.begin(), column_.end(), 0.0);
      column_[at(k)] = 1.0;
      substitute();
      for (int e = 0; e < size_; ++e)
        entry(e, k)[lane] = column_[at(e)];
    }
  }
  return true;
}

bool LaneInverse::eliminate(int n) {
  for (int k = 0; k < size_; ++k) {
    double* pivot = entry(k, k);
    for (int d = 0; d < size_; ++d) {
      if (d != k && !exceeds(n, pivot, entry(d, k))) return false;
    }
    if (!reciprocals(n, pivot)) return false;
    for (int e = 0; e < size_; ++e) {
      if (e != k) scale(n, 1.0, pivot, entry(k, e));
    }
    for (int d = 0; d < size_; ++d) {
      if (d == k) continue;
      for (int e = 0; e < size_; ++e) {
        if (e != k) add_product(n, -1.0, entry(d, k), entry(k, e), entry(d, e));
      }
      scale(n, -1.0, pivot, entry(d, k));
    }
  }
  return true;
}

// LU factorisation with partial pivoting; false when the matrix is singular.
bool LaneInverse::factor(int lane) {
  auto& m = matrix_;
  double largest = 0.0;
  for (std::size_t i = 0; i < m.size(); ++i) {
    m[i] = kept_[i * stride_ + at(lane)];
    largest = std::max(largest, std::fabs(m[i]));
  }
  for (int k = 0; k < size_; ++k) {
    int best = k;
    for (int d = k + 1; d < size_; ++d) {
      if (std::fabs(m[at(d * size_ + k)]) > std::fabs(m[at(best * size_ + k)])) best = d;
    }
    pivot_[at(k)] = best;
    if (!(std::fabs(m[at(best * size_ + k)]) > kSingular * largest)) return false;
    if (best != k)
      std::swap_ranges(&m[at(k * size_)], &m[at(k * size_)] + size_, &m[at(best * size_)]);
    for (int d = k + 1; d < size_; ++d) {
      const double factor = m[at(d * size_ + k)] /= m[at(k * size_ + k)];
      for (int e = k + 1; e < size_; ++e)
        m[at(d * size_ + e)] -= factor * m[at(k * size_ + e)];
    }
  }
  return true;
}

void LaneInverse::substitute() {
  const auto& m = matrix_;
  auto& b = column_;
  for (int k = 0; k < size_; ++k)
    std::swap(b[at(k)], b[at(pivot_[at(k)])]);
  for (int k = 0; k < size_; ++k) {
    for (int d = k + 1; d < size_; ++d)
      b[at(d)] -= m[at(d * size_ + k)] * b[at(k)];
  }
  for (int k = size_; k-- > 0;) {
    for (int e = k + 1; e < size_; ++e)
      b[at(k)] -= m[at(k * size_ + e)] * b[at(e)];
    b[at(k)] /= m[at(k * size_ + k)];
  }
}

void LaneInverse::times(int n, int row, double* const* columns, int apart, double sign,
                        double* out) const {
  std::fill_n(out, n, 0.0);
  for (int d = 0; d < size_; ++d)
    add_product(n, sign, entry(row, d), columns[d * apart], out);
}

}  // namespace shaker::estimator
