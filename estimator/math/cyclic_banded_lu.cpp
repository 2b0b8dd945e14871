#include "estimator/math/cyclic_banded_lu.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/math/lanes.hpp"

namespace shaker::estimator {
namespace {

// Least ratio of a pivot to the largest element of its column. Rows are exchanged only below it,
// because an exchange fills the rows beside.
constexpr double kPivot = 0.1;

// Rows begin at whole registers in the numbering of the columns. What one pivot stores, the
// next one can then load without realignment.
struct Band {
  double* rows;   // each of `width`
  double* lower;  // multipliers, `half` for each pivot
  int* pivot;
  int* end;  // one beyond the last column of each row of the upper factor
  int size, half, margin, width;

  // A pointer such that column c of row r is row(r)[c].
  double* row(int r) const {
    return rows + static_cast<std::ptrdiff_t>(r) * width + margin - r / kLanes * kLanes;
  }
};

SHAKER_SIMD_CLONES void exchange(int groups, Lanes* __restrict a, Lanes* __restrict b) {
  for (int g = 0; g < groups; ++g)
    std::swap(a[g], b[g]);
}

// Eliminates pivot k from the rows below it, up to `last`, in the registers from the one that
// holds column k. Values that it leaves in eliminated columns are not read again. The pivot's
// row is 0 beyond its end, so that the rows below keep their values there.
template <int Groups>
SHAKER_INLINE void eliminate(const Band& band, int k, int last) {
  const int from = k / kLanes * kLanes;
  const double* pivot = band.row(k);
  Lanes upper[Groups];
  for (int g = 0; g < Groups; ++g)
    upper[g] = as_lanes(pivot + from)[g];
  double* lower = band.lower + static_cast<std::ptrdiff_t>(k) * band.half;
  const double inverse = 1.0 / pivot[k];
  for (int r = k + 1; r <= last; ++r) {
    double* row = band.row(r);
    const double multiplier = row[k] * inverse;
    *lower++ = multiplier;
    if (multiplier == 0.0) continue;
    Lanes* target = as_lanes(row + from);
    for (int g = 0; g < Groups; ++g)
      target[g] -= multiplier * upper[g];
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

// Selects the row for position k.
SHAKER_INLINE int pivot_of(const Band& band, int k, int last) {
  const auto size_at = [&](int r) { return std::fabs(band.row(r)[k]); };
  double even = 0.0, odd = 0.0;  // two independent chains, because each maximum waits for the last
  int r = k + 1;
  for (; r < last; r += 2) {
    even = std::max(even, size_at(r));
    odd = std::max(odd, size_at(r + 1));
  }
  if (r == last) even = std::max(even, size_at(r));
  const double most = std::max(even, odd);
  if (!(size_at(k) < kPivot * most)) return k;  // also if a value is NaN
  for (r = k + 1; r < last && size_at(r) < most; ++r) {
  }
  return r;
}

SHAKER_SIMD_CLONES bool factorise_band(const Band& band) {
  int end = 0;  // no row so far has elements beyond it
  for (int k = 0; k < band.size; ++k) {
    const int last = std::min(band.size - 1, k + band.half);
    const int best = pivot_of(band, k, last);
    band.pivot[k] = best;
    end = std::max(end, std::min(band.size, best + band.half + 1));
    band.end[k] = end;
    const int from = k / kLanes, groups = (end - 1) / kLanes - from + 1;
    if (best != k)
      exchange(groups, as_lanes(band.row(k) + from * kLanes),
               as_lanes(band.row(best) + from * kLanes));
    if (!(std::fabs(band.row(k)[k]) > std::numeric_limits<double>::min())) return false;
    switch (groups) {
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
      case 6:
        eliminate<6>(band, k, last);
        break;
      default:
        eliminate_any(band, k, last, end);
    }
  }
  return true;
}

// Solves in place, for right-hand sides in rows of `Groups` lanes.
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
    // Four independent sums, because each waits for the last; the newest unknowns come last.
    Lanes sum[4 * Groups] = {};
    int c = band.end[k];
    for (; c - 4 > k; c -= 4) {
      for (int j = 0; j < 4 * Groups; ++j)
        sum[j] += upper[c - 4 + j / Groups] * own[(c - 4 - k) * Groups + j];
    }
    for (--c; c > k; --c) {
      for (int g = 0; g < Groups; ++g)
        sum[c % 4 * Groups + g] += upper[c] * own[(c - k) * Groups + g];
    }
    const double inverse = 1.0 / upper[k];
    for (int g = 0; g < Groups; ++g)
      own[g] =
          (own[g] - ((sum[g] + sum[Groups + g]) + (sum[2 * Groups + g] + sum[3 * Groups + g]))) *
          inverse;
  }
}

// The same with the transposed matrix: its factors in reverse order.
SHAKER_SIMD_CLONES void substitute_transposed(const Band& band, Lanes* rows) {
  for (int k = 0; k < band.size; ++k) {
    Lanes* own = rows + k;
    const double* upper = band.row(k);
    *own *= 1.0 / upper[k];
    for (int c = k + 1; c < band.end[k]; ++c)
      own[c - k] -= upper[c] * *own;
  }
  for (int k = band.size - 1; k >= 0; --k) {
    Lanes* own = rows + k;
    const double* lower = band.lower + static_cast<std::ptrdiff_t>(k) * band.half;
    const int below = std::min(band.size - 1 - k, band.half);
    Lanes sum[2] = {};
    for (int r = 0; r < below; ++r)
      sum[r % 2] += lower[r] * own[r + 1];
    *own -= sum[0] + sum[1];
    if (band.pivot[k] != k) std::swap(*own, rows[band.pivot[k]]);
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
      across_(2 * reach + 1),
      size_(n * block),
      half_(std::min(2 * reach * block + block - 1, size_ - 1)),
      margin_((half_ + kLanes - 1) / kLanes * kLanes),
      width_(margin_ + (2 * half_ + 2 * kLanes) / kLanes * kLanes),
      band_(static_cast<std::size_t>(size_) * width_),
      lower_(static_cast<std::size_t>(size_) * half_),
      pivot_(size_),
      end_(size_),
      columns_(static_cast<std::size_t>(n) * across_),
      folded_rows_(static_cast<std::size_t>(size_) * 2 * kLanes) {
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < across_; ++k)
      columns_[static_cast<std::size_t>(i * across_ + k)] = folded((i + k - reach + n) % n) * block;
  }
}

void CyclicBandedLu::add(int i, int row, int column, const double* values) {
  double* own = storage(folded(i) * block_ + row) + column;
  const int* columns = &columns_[static_cast<std::size_t>(i) * across_];
  for (int k = 0; k < across_; ++k)
    own[columns[k]] += values[k];
}

void CyclicBandedLu::clear() {
  std::fill(band_.begin(), band_.end(), 0.0);
}

bool CyclicBandedLu::factorise() {
  return factorise_band(
      {band_.data(), lower_.data(), pivot_.data(), end_.data(), size_, half_, margin_, width_});
}

void CyclicBandedLu::solve(double* rows, int stride, int width) {
  solve(rows, stride, width, false);
}

void CyclicBandedLu::solve_transposed(double* rows, int stride, int width) {
  solve(rows, stride, width, true);
}

void CyclicBandedLu::solve(double* rows, int stride, int width, bool transposed) {
  const Band band{band_.data(), lower_.data(), pivot_.data(), end_.data(),
                  size_,        half_,         margin_,       width_};
  const int most = transposed ? kLanes : 2 * kLanes;
  for (int first = 0; first < width;) {
    const int count = std::min(width - first, most);
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
    const auto substitute = transposed       ? substitute_transposed
                            : lanes > kLanes ? substitute_wide
                                             : substitute_narrow;
    substitute(band, as_lanes(folded_rows_.data()));
    each([&](double* to, const double* from) { std::copy_n(from, count, to); });
    first += count;
  }
}

}  // namespace shaker::estimator
