// LU factorisation of a cyclic block-banded matrix, with partial pivoting, in O(n).
//
// The unknowns on a ring couple to their neighbours only, first and last included. Folding the ring
// (0, n-1, 1, n-2, ...) turns the two corners into an ordinary band of twice the width, which
// Gaussian elimination with row exchanges keeps; so it is as stable as a dense LU.
#pragma once

#include <cstddef>
#include <vector>

#include "estimator/math/aligned.hpp"

namespace shaker::estimator {

// Storage is made once; `clear`, `add`, `factorise` and `solve` do not allocate. One thread.
class CyclicBandedLu {
 public:
  // n >= 2 * reach + 1 blocks of size `block`; block row i couples to i - reach .. i + reach (mod
  // n).
  CyclicBandedLu(int n, int block, int reach);

  void clear();
  // Adds to the matrix: equation `row` of block i, unknown `column` of block (i + offset) mod n.
  void add(int i, int row, int offset, int column, double value) {
    int j = i + offset;
    j += j < 0 ? n_ : j >= n_ ? -n_ : 0;
    const int r = folded(i) * block_ + row;
    band(r)[folded(j) * block_ + column - r + half_] += value;
  }
  // False when a pivot vanishes.
  bool factorise();
  // Solves for `width` right-hand sides at once, in place. `rows` holds n * block rows of `stride`
  // doubles; row i * block + c belongs to unknown c of block i.
  void solve(double* rows, int stride, int width);

 private:
  int folded(int i) const { return 2 * i < n_ ? 2 * i : 2 * (n_ - 1 - i) + 1; }
  double* band(int row) { return &band_[static_cast<std::size_t>(row) * width_]; }

  int n_, block_, size_, half_, width_;
  std::vector<double> band_;   // row r holds columns r - half_ .. r + 2 half_
  std::vector<double> lower_;  // multipliers, half_ a pivot
  std::vector<int> pivot_;
  std::vector<int> end_;  // how far a row of the upper factor reaches: exchanges fill it
  AlignedVector folded_rows_;
};

}  // namespace shaker::estimator
