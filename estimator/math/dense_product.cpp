#include "estimator/math/dense_product.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "estimator/math/aligned.hpp"
#include "estimator/math/lanes.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// A tile of the product: its sums are twelve registers of the sixteen that AVX2 has.
constexpr Index kRegisters = 3, kRows = 4 * kRegisters, kColumns = 4;

using ColumnsOfB = std::array<const double*, kColumns>;

// `a`: rows of the tile, kRows values for each element of a column of b. `out`: column by column.
SHAKER_SIMD_CLONES void tile(Index depth, const double* a, const ColumnsOfB& b, double* out) {
  HalfLanes sum[kColumns][kRegisters] = {};
  const auto* rows = reinterpret_cast<const HalfLanes*>(a);
  for (Index k = 0; k < depth; ++k, rows += kRegisters) {
    const HalfLanes first = rows[0], second = rows[1], third = rows[2];
    for (Index c = 0; c < kColumns; ++c) {
      const double x = b[static_cast<std::size_t>(c)][k];
      sum[c][0] += x * first;
      sum[c][1] += x * second;
      sum[c][2] += x * third;
    }
  }
  std::copy_n(&sum[0][0], kColumns * kRegisters, reinterpret_cast<HalfLanes*>(out));
}

// The tiles' rows one after the other, the last one filled up with zeros.
AlignedVector in_tiles(const MatrixXd& a) {
  const Index tiles = (a.rows() + kRows - 1) / kRows;
  AlignedVector packed(static_cast<std::size_t>(tiles * kRows * a.cols()), 0.0);
  for (Index t = 0; t < tiles; ++t) {
    const Index first = t * kRows, count = std::min(kRows, a.rows() - first);
    for (Index k = 0; k < a.cols(); ++k)
      std::copy_n(&a(first, k), count,
                  &packed[static_cast<std::size_t>((t * a.cols() + k) * kRows)]);
  }
  return packed;
}

// `packed`: a in tiles. `own`: b is a^T, only the lower half is computed.
MatrixXd multiplied(const MatrixXd& a, const AlignedVector& packed, const MatrixXd& b, bool own) {
  const Index depth = a.cols();
  MatrixXd c(a.rows(), b.cols());
  if (c.size() == 0 || depth == 0) return MatrixXd::Zero(a.rows(), b.cols());
  alignas(64) double out[kRows * kColumns];
  for (Index column = 0; column < c.cols(); column += kColumns) {
    ColumnsOfB columns;
    for (Index k = 0; k < kColumns; ++k)
      columns[static_cast<std::size_t>(k)] =
          b.data() + std::min(column + k, c.cols() - 1) * b.rows();
    for (Index first = own ? column / kRows * kRows : 0; first < c.rows(); first += kRows) {
      tile(depth, &packed[static_cast<std::size_t>(first * depth)], columns, out);
      const Index count = std::min(kRows, c.rows() - first);
      for (Index k = 0; k < std::min(kColumns, c.cols() - column); ++k)
        std::copy_n(out + k * kRows, count, &c(first, column + k));
    }
  }
  return c;
}

}  // namespace

MatrixXd product(const MatrixXd& a, const MatrixXd& b) {
  return multiplied(a, in_tiles(a), b, false);
}

MatrixXd product_with_own(const MatrixXd& a) {
  MatrixXd c = multiplied(a, in_tiles(a), a.transpose(), true);
  c.triangularView<Eigen::StrictlyUpper>() = c.transpose();
  return c;
}

LeftFactor::LeftFactor(MatrixXd matrix) : matrix_(std::move(matrix)), tiles_(in_tiles(matrix_)) {}

MatrixXd LeftFactor::times(const MatrixXd& b) const {
  return multiplied(matrix_, tiles_, b, false);
}

}  // namespace shaker::estimator
