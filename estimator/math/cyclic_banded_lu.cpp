#include "estimator/math/cyclic_banded_lu.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "estimator/math/lanes.hpp"

namespace shaker::estimator {
namespace {

struct Band {
  double* rows;   // each of `width`, its diagonal at `half`
  double* lower;  // multipliers, `half` a pivot
  int* pivot;
  int* end;  // one beyond the last column of a row of the upper factor
  int size, half, width;

  // Such that column c of row r is row(r)[c].
  double* row(int r) const { return rows + static_cast<std::ptrdiff_t>(r) * (width - 1) + half; }
};

SHAKER_SIMD_CLONES void exchange(int count, double* __restrict a, double* __restrict b) {
  for (int c = 0; c < count; ++c)
    std::swap(a[c], b[c]);
}

// Takes pivot k out of the rows below it, up to `last`, in the Groups * kLanes columns after k. The
// pivot's row is 0 beyond its end, so that those below stay what they are there.
template <int Groups>
SHAKER_INLINE void eliminate(const Band& band, int k, int last) {
  const double* pivot = band.row(k) + k;
  Lanes upper[Groups];
  std::memcpy(upper, pivot + 1, sizeof upper);
  double* lower = band.lower + static_cast<std::ptrdiff_t>(k) * band.half;
  const double inverse = 1.0 / *pivot;
  for (int r = k + 1; r <= last; ++r) {
    double* target = band.row(r) + k;
    const double multiplier = *target * inverse;
    *lower++ = multiplier;
    if (multiplier == 0.0) continue;
    for (int g = 0; g < Groups; ++g) {
      Lanes some;
      std::memcpy(&some, target + 1 + g * kLanes, sizeof some);
      some -= multiplier * upper[g];
      std::memcpy(target + 1 + g * kLanes, &some, sizeof some);
    }
  }
}

SHAKER_INLINE void eliminate_any(const Band& band, int k, int last, int end) {
  const double* __restrict upper = band.row(k);
  double* lower = band.lower + static_cast<std::ptrdiff_t>(k) * band.half;
  for (int r = k + 1; r <= last; ++r) {
    double* __restrict target = band.row(r);
    const double multiplier = target[k] / upper[k];
    *lower++ = multiplier;
    if (multiplier == 0.0) continue;
    for (int c = k + 1; c < end; ++c)
      target[c] -= multiplier * upper[c];
  }
}

SHAKER_SIMD_CLONES bool factorise_band(const Band& band) {
  int end = 0;  // beyond it nothing has been filled in yet
  for (int k = 0; k < band.size; ++k) {
    const int last = std::min(band.size - 1, k + band.half);
    int best = k;
    for (int r = k + 1; r <= last; ++r) {
      if (std::fabs(band.row(r)[k]) > std::fabs(band.row(best)[k])) best = r;
    }
    band.pivot[k] = best;
    end = std::max(end, std::min(band.size, best + band.half + 1));
    band.end[k] = end;
    if (best != k) exchange(end - k, band.row(k) + k, band.row(best) + k);
    if (!(std::fabs(band.row(k)[k]) > std::numeric_limits<double>::min())) return false;
    switch ((end - k - 1 + kLanes - 1) / kLanes) {
      case 0:
        break;
      case 1:
        eliminate<1>(band, k, last);
        break;
      case 2:
        eliminate<2>(band, k, last);
        break;
      case 3:
        eliminate<3>(band, k, last);
        break;
      case 4:
        eliminate<4>(band, k, last);
        break;
      case 5:
        eliminate<5>(band, k, last);
        break;
      default:
        eliminate_any(band, k, last, end);
    }
  }
  return true;
}

// In place, of right-hand sides in rows of `Groups` lanes.
template <int Groups>
SHAKER_INLINE void substitute(const Band& band, Lanes* rows) {
  for (int k = 0; k < band.size; ++k) {
    Lanes* own = rows + static_cast<std::ptrdiff_t>(k) * Groups;
    if (band.pivot[k] != k) {
      Lanes* other = rows + static_cast<std::ptrdiff_t>(band.pivot[k]) * Groups;
      for (int g = 0; g < Groups; ++g)
        std::swap(own[g], other[g]);
    }
    Lanes known[Groups];
    for (int g = 0; g < Groups; ++g)
      known[g] = own[g];
    const double* lower = band.lower + static_cast<std::ptrdiff_t>(k) * band.half;
    const int below = std::min(band.size - 1 - k, band.half);
    for (int r = 0; r < below; ++r) {
      for (int g = 0; g < Groups; ++g)
        own[(r + 1) * Groups + g] -= lower[r] * known[g];
    }
  }
  for (int k = band.size - 1; k >= 0; --k) {
    Lanes* own = rows + static_cast<std::ptrdiff_t>(k) * Groups;
    const double* upper = band.row(k);
    Lanes sum[Groups];
    for (int g = 0; g < Groups; ++g)
      sum[g] = own[g];
    for (int c = k + 1; c < band.end[k]; ++c) {
      for (int g = 0; g < Groups; ++g)
        sum[g] -= upper[c] * own[(c - k) * Groups + g];
    }
    for (int g = 0; g < Groups; ++g)
      own[g] = sum[g] / upper[k];
  }
}

SHAKER_SIMD_CLONES void substitute_narrow(const Band& band, Lanes* rows) {
  substitute<1>(band, rows);
}
SHAKER_SIMD_CLONES void substitute_wide(const Band& band, Lanes* rows) {
  substitute<2>(band, rows);
}

}  // namespace

CyclicBandedLu::CyclicBandedLu(int n, int block, int reach)
    : n_(n),
      block_(block),
      size_(n * block),
      half_(std::min(2 * reach * block + block - 1, size_ - 1)),
      width_(3 * half_ + 1 + kLanes),  // whole registers may look beyond the last column
      band_(static_cast<std::size_t>(size_) * width_ + kLanes),
      lower_(static_cast<std::size_t>(size_) * half_),
      pivot_(size_),
      end_(size_),
      folded_rows_(static_cast<std::size_t>(size_) * 2 * kLanes) {}

void CyclicBandedLu::clear() {
  std::fill(band_.begin(), band_.end(), 0.0);
}

bool CyclicBandedLu::factorise() {
  return factorise_band(
      {band_.data(), lower_.data(), pivot_.data(), end_.data(), size_, half_, width_});
}

void CyclicBandedLu::solve(double* rows, int stride, int width) {
  const Band band{band_.data(), lower_.data(), pivot_.data(), end_.data(), size_, half_, width_};
  for (int first = 0; first < width;) {
    const int count = std::min(width - first, 2 * kLanes);
    const int lanes = count > kLanes ? 2 * kLanes : kLanes;
    const auto each = [&](auto&& copied) {
      for (int i = 0; i < n_; ++i) {
        for (int c = 0; c < block_; ++c)
          copied(rows + static_cast<std::ptrdiff_t>(i * block_ + c) * stride + first,
                 folded_rows_.data() + static_cast<std::ptrdiff_t>(folded(i) * block_ + c) * lanes);
      }
    };
    each([&](const double* from, double* to) {
      std::fill(std::copy_n(from, count, to), to + lanes, 0.0);
    });
    (lanes > kLanes ? substitute_wide : substitute_narrow)(band, as_lanes(folded_rows_.data()));
    each([&](double* to, const double* from) { std::copy_n(from, count, to); });
    first += count;
  }
}

}  // namespace shaker::estimator
