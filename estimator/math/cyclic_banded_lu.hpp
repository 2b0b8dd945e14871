// LU factorisation of a cyclic block-banded matrix, with row exchanges, in O(n).
//
// The unknowns on a ring couple to their neighbours only, first and last included. Folding the ring
// (0, n-1, 1, n-2, ...) turns the two corners into an ordinary band of twice the width, which
// Gaussian elimination with row exchanges keeps. A pivot is exchanged where it is less than a tenth
// of its column's largest: nearly as stable as a dense LU, unless rows are scaled by many orders.
#pragma once

#include <cstddef>
#include <vector>

#include "estimator/math/aligned.hpp"
#include "estimator/math/lanes.hpp"

namespace shaker::estimator {

// Storage is made once; `clear`, `add`, `factorise` and `solve` do not allocate. One thread.
class CyclicBandedLu {
 public:
  // n >= 2 * reach + 1 blocks of size `block`; block row i couples to i - reach .. i + reach (mod
  // n).
  CyclicBandedLu(int n, int block, int reach);

  void clear();
  // Adds to the matrix: equation `row` of block i, unknown `column` of the blocks i - reach ..
  // i + reach (mod n), one value for each.
  void add(int i, int row, int column, const double* values);
  // False when a pivot vanishes.
  bool factorise();
  // Solves for `width` right-hand sides at once, in place. `rows` holds n * block rows of `stride`
  // doubles; row i * block + c is given for equation c of block i and comes out for its unknown c.
  void solve(double* rows, int stride, int width);
  // The same with the transposed matrix: given for an unknown, out for an equation.
  void solve_transposed(double* rows, int stride, int width);

 private:
  void solve(double* rows, int stride, int width, bool transposed);
  int folded(int i) const { return 2 * i < n_ ? 2 * i : 2 * (n_ - 1 - i) + 1; }

  // Such that column c of row r is storage(r)[c].
  double* storage(int r) {
    return &band_[static_cast<std::size_t>(r) * width_] + margin_ - r / kLanes * kLanes;
  }

  int n_, block_, across_, size_, half_;
  int margin_, width_;  // of a row's storage: before its own register of columns, and as a whole
  AlignedVector band_;  // row r holds columns r - half_ .. r + 2 half_
  std::vector<double> lower_;  // multipliers, half_ a pivot
  std::vector<int> pivot_;
  std::vector<int> end_;      // how far a row of the upper factor reaches: exchanges fill it
  std::vector<int> columns_;  // of each block: where those that it couples to begin
  AlignedVector folded_rows_;
};

}  // namespace shaker::estimator
