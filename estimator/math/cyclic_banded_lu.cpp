#include "estimator/math/cyclic_banded_lu.hpp"

#include <algorithm>
#include <cmath>

namespace shaker::estimator {

CyclicBandedLu::CyclicBandedLu(int n, int block, int reach)
    : n_(n),
      block_(block),
      size_(n * block),
      half_(std::min(2 * reach * block + block - 1, size_ - 1)),
      width_(3 * half_ + 1),
      band_(static_cast<std::size_t>(size_) * width_),
      lower_(static_cast<std::size_t>(size_) * half_),
      pivot_(size_) {}

void CyclicBandedLu::clear() {
  std::fill(band_.begin(), band_.end(), 0.0);
}

void CyclicBandedLu::add(int i, int row, int offset, int column, double value) {
  const int j = (i + offset + n_) % n_;
  const int r = folded(i) * block_ + row;
  const int c = folded(j) * block_ + column;
  band(r)[c - r + half_] += value;
}

bool CyclicBandedLu::factorise() {
  for (int k = 0; k < size_; ++k) {
    const int last = std::min(size_ - 1, k + half_);
    int best = k;
    for (int r = k + 1; r <= last; ++r) {
      if (std::fabs(band(r)[k - r + half_]) > std::fabs(band(best)[k - best + half_])) best = r;
    }
    pivot_[k] = best;
    const int end = std::min(size_ - 1, k + 2 * half_);
    if (best != k) {
      for (int c = k; c <= end; ++c)
        std::swap(band(k)[c - k + half_], band(best)[c - best + half_]);
    }
    const double pivot = band(k)[half_];
    if (!(std::fabs(pivot) > 0.0)) return false;
    const double* upper = band(k) + half_ - k;
    for (int r = k + 1; r <= last; ++r) {
      double* target = band(r) + half_ - r;
      const double multiplier = target[k] / pivot;
      lower_[static_cast<std::size_t>(k) * half_ + (r - k - 1)] = multiplier;
      if (multiplier == 0.0) continue;
      for (int c = k + 1; c <= end; ++c)
        target[c] -= multiplier * upper[c];
    }
  }
  return true;
}

void CyclicBandedLu::solve(double* rows, int stride, int width) {
  folded_rows_.resize(static_cast<std::size_t>(size_) * width);
  const auto at = [&](int r) { return folded_rows_.data() + static_cast<std::size_t>(r) * width; };
  for (int i = 0; i < n_; ++i) {
    for (int c = 0; c < block_; ++c)
      std::copy_n(rows + static_cast<std::size_t>(i * block_ + c) * stride, width,
                  at(folded(i) * block_ + c));
  }
  for (int k = 0; k < size_; ++k) {
    if (pivot_[k] != k) std::swap_ranges(at(k), at(k) + width, at(pivot_[k]));
    const int last = std::min(size_ - 1, k + half_);
    for (int r = k + 1; r <= last; ++r) {
      const double multiplier = lower_[static_cast<std::size_t>(k) * half_ + (r - k - 1)];
      for (int w = 0; w < width; ++w)
        at(r)[w] -= multiplier * at(k)[w];
    }
  }
  for (int k = size_ - 1; k >= 0; --k) {
    const int end = std::min(size_ - 1, k + 2 * half_);
    const double* upper = band(k) + half_ - k;
    for (int c = k + 1; c <= end; ++c) {
      for (int w = 0; w < width; ++w)
        at(k)[w] -= upper[c] * at(c)[w];
    }
    for (int w = 0; w < width; ++w)
      at(k)[w] /= upper[k];
  }
  for (int i = 0; i < n_; ++i) {
    for (int c = 0; c < block_; ++c)
      std::copy_n(at(folded(i) * block_ + c), width,
                  rows + static_cast<std::size_t>(i * block_ + c) * stride);
  }
}

}  // namespace shaker::estimator
