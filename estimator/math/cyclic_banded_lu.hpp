/// \file
/// LU factorisation of a cyclic block-banded matrix, with row exchanges, in O(n).
///
/// The unknowns of each point of a ring couple to those of its neighbours only; the first and
/// the last point are neighbours. The order 0, n-1, 1, n-2, ... (folding) moves the two corners
/// of the matrix into an ordinary band of twice the width, which Gaussian elimination with row
/// exchanges keeps. Rows are exchanged if the pivot is less than a tenth of the largest element
/// of its column. That is nearly as stable as a dense LU, unless the rows differ in scale by
/// many orders of magnitude.
#pragma once

#include <cstddef>
#include <vector>

#include "estimator/math/aligned.hpp"
#include "estimator/math/lanes.hpp"

namespace shaker::estimator {

/// Only the constructor allocates. One thread at a time may use it.
class CyclicBandedLu {
 public:
  /// n >= 2 * reach + 1 blocks of size `block`. Block row i couples to the columns of blocks
  /// i - reach .. i + reach (mod n).
  /// \param n number of blocks
  /// \param block unknowns of a block
  /// \param reach blocks to each side that a block couples to
  CyclicBandedLu(int n, int block, int reach);

  /// Sets the matrix to zero.
  void clear();
  /// Adds 2 * reach + 1 values to the matrix: equation `row` of block i, unknown `column` of the
  /// blocks i - reach .. i + reach (mod n).
  /// \param i block row
  /// \param row equation in the block
  /// \param column unknown in the block
  /// \param values 2 * reach + 1 values
  void add(int i, int row, int column, const double* values);
  /// \return false if a pivot is zero (or not finite)
  bool factorise();
  /// Solves for `width` right-hand sides at once, in place. `rows` holds n * block rows of
  /// `stride` doubles. Row i * block + c is equation c of block i on input, its unknown c on
  /// output.
  /// \param rows right-hand sides on entry, solutions on return
  /// \param stride distance of the rows, doubles
  /// \param width number of right-hand sides
  void solve(double* rows, int stride, int width);
  /// The same with the transposed matrix: unknowns on input, equations on output.
  /// \param rows right-hand sides on entry, solutions on return
  /// \param stride distance of the rows, doubles
  /// \param width number of right-hand sides
  void solve_transposed(double* rows, int stride, int width);

 private:
  void solve(double* rows, int stride, int width, bool transposed);
  int folded(int i) const { return 2 * i < n_ ? 2 * i : 2 * (n_ - 1 - i) + 1; }

  // A pointer such that column c of row r is storage(r)[c].
  double* storage(int r) {
    return &band_[static_cast<std::size_t>(r) * width_] + margin_ - r / kLanes * kLanes;
  }

  int n_, block_, across_, size_, half_;
  int margin_, width_;  // of a row's storage: space before its first register of columns; total
  AlignedVector band_;  // row r holds columns r - half_ .. r + 2 half_
  std::vector<double> lower_;  // multipliers, half_ for each pivot
  std::vector<int> pivot_;
  std::vector<int> end_;      // end of each row of the upper factor; exchanges extend it
  std::vector<int> columns_;  // of each block: first columns of the blocks to which it couples
  AlignedVector folded_rows_;
};

}  // namespace shaker::estimator
