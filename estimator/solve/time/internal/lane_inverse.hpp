// Inverses of small matrices, one in each lane.
#pragma once

#include <cstddef>
#include <vector>

#include "estimator/math/aligned.hpp"

namespace shaker::estimator {

// Elimination runs over all lanes at once and exchanges no rows. Where a pivot is small, each lane
// is factorised alone, with exchanges. Allocates when n or `size` is larger than before.
class LaneInverse {
 public:
  // Arrays of n lanes for the matrices' entries; the caller writes them, then calls invert().
  void shape(int n, int size);
  double* entry(int row, int column) {
    return &entries_[(static_cast<std::size_t>(row * size_ + column)) * stride_];
  }
  const double* entry(int row, int column) const {
    return &entries_[(static_cast<std::size_t>(row * size_ + column)) * stride_];
  }
  // Replaces the matrices of the first n lanes by their inverses. False where one is singular: its
  // pivot is below 1e-14 of its largest entry. The entries are then unspecified.
  bool invert(int n);

  // `out` = sign * (row `row` of the inverse) times a column, of which columns[d * apart] is row d.
  void times(int n, int row, double* const* columns, int apart, double sign, double* out) const;

 private:
  bool eliminate(int n);
  bool factor(int lane);
  void substitute();

  int size_ = 0;
  std::size_t stride_ = 0;
  AlignedVector entries_, kept_;
  std::vector<double> matrix_, column_;  // of one lane
  std::vector<int> pivot_;
};

}  // namespace shaker::estimator
