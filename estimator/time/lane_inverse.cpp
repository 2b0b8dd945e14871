#include "estimator/time/lane_inverse.hpp"

#include <algorithm>
#include <cmath>

namespace shaker::estimator {
namespace {

constexpr double kPivot = 1e-5;      // smallest pivot without an exchange, over the others' size
constexpr double kSingular = 1e-14;  // smallest pivot, relative to the matrix's largest entry

std::size_t at(int i) {
  return static_cast<std::size_t>(i);
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
    double* __restrict pivot = entry(k, k);
    for (int d = 0; d < size_; ++d) {
      const double* __restrict below = entry(d, k);
      for (int i = 0; d != k && i < n; ++i) {
        if (!(std::fabs(pivot[i]) >= kPivot * std::fabs(below[i]))) return false;
      }
    }
    if (std::any_of(pivot, pivot + n, [](double x) { return x == 0.0; })) return false;
    for (int i = 0; i < n; ++i)
      pivot[i] = 1.0 / pivot[i];
    for (int e = 0; e < size_; ++e) {
      double* __restrict right = entry(k, e);
      for (int i = 0; e != k && i < n; ++i)
        right[i] *= pivot[i];
    }
    for (int d = 0; d < size_; ++d) {
      if (d == k) continue;
      double* __restrict below = entry(d, k);
      for (int e = 0; e < size_; ++e) {
        if (e == k) continue;
        double* __restrict other = entry(d, e);
        const double* __restrict right = entry(k, e);
        for (int i = 0; i < n; ++i)
          other[i] -= below[i] * right[i];
      }
      for (int i = 0; i < n; ++i)
        below[i] *= -pivot[i];
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
  double* __restrict to = out;
  std::fill_n(to, n, 0.0);
  for (int d = 0; d < size_; ++d) {
    const double* __restrict inverse = entry(row, d);
    const double* __restrict column = columns[d * apart];
    for (int i = 0; i < n; ++i)
      to[i] += sign * inverse[i] * column[i];
  }
}

}  // namespace shaker::estimator
