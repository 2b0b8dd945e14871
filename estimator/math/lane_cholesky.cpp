#include "estimator/math/lane_cholesky.hpp"

#include <cmath>

namespace shaker::estimator {
namespace {

SHAKER_INLINE void square_root(const Lanes& x, Lanes& root) {
  for (int l = 0; l < kLanes; ++l)
    root[l] = std::sqrt(x[l]);
}

}  // namespace

SHAKER_SIMD_CLONES unsigned factorise_lanes(int size, Lanes* matrix) {
  LaneMask sound = ~LaneMask{};
  for (int k = 0; k < size; ++k) {
    Lanes* row = matrix + packed(k, 0);
    const Lanes diagonal = row[k];
    Lanes sum = diagonal;
    for (int m = 0; m < k; ++m)
      sum -= row[m] * row[m];
    sound &= sum > 1e-13 * diagonal;
    const Lanes safe = chosen(sum > 0.0, sum, 1.0);
    Lanes root;
    square_root(safe, root);
    const Lanes inverse = 1.0 / root;
    row[k] = inverse;
    for (int r = k + 1; r < size; ++r) {
      Lanes* below = matrix + packed(r, 0);
      Lanes value = below[k];
      for (int m = 0; m < k; ++m)
        value -= below[m] * row[m];
      below[k] = value * inverse;
    }
  }
  return bits_of(sound);
}

SHAKER_SIMD_CLONES void substitute_lanes(int size, const Lanes* factor, Lanes* b) {
  for (int k = 0; k < size; ++k) {
    for (int m = 0; m < k; ++m)
      b[k] -= factor[packed(k, m)] * b[m];
    b[k] *= factor[packed(k, k)];
  }
  for (int k = size - 1; k >= 0; --k) {
    for (int r = k + 1; r < size; ++r)
      b[k] -= factor[packed(r, k)] * b[r];
    b[k] *= factor[packed(k, k)];
  }
}

// A^-1 = L^-T L^-1: its diagonal holds the sums of squares of the columns of L^-1.
SHAKER_SIMD_CLONES void inverse_diagonal_lanes(int size, const Lanes* factor, Lanes* scratch,
                                               Lanes* diagonal) {
  for (int j = 0; j < size; ++j) {
    diagonal[j] = Lanes{};
    for (int k = j; k < size; ++k) {
      Lanes value = k == j ? Lanes{} + 1.0 : Lanes{};
      for (int m = j; m < k; ++m)
        value -= factor[packed(k, m)] * scratch[m];
      scratch[k] = value * factor[packed(k, k)];
      diagonal[j] += scratch[k] * scratch[k];
    }
  }
}

}  // namespace shaker::estimator
