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
using Eigen::VectorXd;

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

constexpr Index kTriangle = 32;  // rows that are solved one after the other

// x: l^-1 x, where l is the lower triangle of `count` rows at `l`, `apart` values a column.
SHAKER_SIMD_CLONES void solve_triangle(Index count, const double* l, Index apart,
                                       double* __restrict x) {
  for (Index k = 0; k < count; ++k) {
    const double* __restrict column = l + k * apart;
    const double value = x[k] /= column[k];
    for (Index i = k + 1; i < count; ++i)
      x[i] -= column[i] * value;
  }
}

constexpr Index kAbreast = 12;  // columns that are reflected at once, in registers' worth
constexpr Index kGroups = kAbreast / 4;

// rows: kAbreast values for each of the n rows. Reflects by v = (1, tail), the first row of which
// is `rows`.
SHAKER_SIMD_CLONES void reflect(Index n, const double* __restrict tail, double factor,
                                double* __restrict rows) {
  auto* __restrict at = reinterpret_cast<HalfLanes*>(rows);
  HalfLanes sum[kGroups];
  for (Index g = 0; g < kGroups; ++g)
    sum[g] = at[g];
  for (Index i = 1; i < n; ++i) {
    for (Index g = 0; g < kGroups; ++g)
      sum[g] += tail[i - 1] * at[i * kGroups + g];
  }
  for (Index g = 0; g < kGroups; ++g) {
    sum[g] *= factor;
    at[g] -= sum[g];
  }
  for (Index i = 1; i < n; ++i) {
    for (Index g = 0; g < kGroups; ++g)
      at[i * kGroups + g] -= tail[i - 1] * sum[g];
  }
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

MatrixXd lower_quotient(const MatrixXd& l, MatrixXd b) {
  for (Index first = 0; first < l.rows(); first += kTriangle) {
    const Index count = std::min(kTriangle, l.rows() - first);
    if (first > 0)
      b.middleRows(first, count) -= product(l.block(first, 0, count, first), b.topRows(first));
    for (Index k = 0; k < b.cols(); ++k)
      solve_triangle(count, &l(first, first), l.rows(), &b(first, k));
  }
  return b;
}

MatrixXd reflected(const MatrixXd& reflectors, const VectorXd& factors, const MatrixXd& b) {
  const Index n = b.rows();
  MatrixXd out(n, b.cols());
  AlignedVector rows(static_cast<std::size_t>(n * kAbreast));
  for (Index first = 0; first < b.cols(); first += kAbreast) {
    const Index count = std::min(kAbreast, b.cols() - first);
    for (Index i = 0; i < n; ++i) {
      for (Index k = 0; k < kAbreast; ++k)
        rows[static_cast<std::size_t>(i * kAbreast + k)] = k < count ? b(i, first + k) : 0.0;
    }
    for (Index k = 0; k + 1 < n; ++k)
      reflect(n - k - 1, reflectors.data() + k * n + k + 2, factors[k],
              &rows[static_cast<std::size_t>((k + 1) * kAbreast)]);
    for (Index k = 0; k < count; ++k) {
      for (Index i = 0; i < n; ++i)
        out(i, first + k) = rows[static_cast<std::size_t>(i * kAbreast + k)];
    }
  }
  return out;
}

LeftFactor::LeftFactor(MatrixXd matrix) : matrix_(std::move(matrix)), tiles_(in_tiles(matrix_)) {}

MatrixXd LeftFactor::times(const MatrixXd& b) const {
  return multiplied(matrix_, tiles_, b, false);
}

}  // namespace shaker::estimator
