// Operations of a batch of eight rings before and after solve_lane_step(): differences, sums of
// products, and the update of the state.
#include <cstddef>

#include "estimator/solve/periodic/internal/lane_step.hpp"

namespace shaker::estimator {
namespace {

template <int Reach>
SHAKER_INLINE void difference(int n, const Stencil& stencil, const Lanes& rate, const Lanes* z,
                              Lanes* v, Lanes* a) {
  const Lanes square = rate * rate;
  for (int i = 0; i < n; ++i) {
    Lanes dv{};
    Lanes da{};
    const bool inside = i >= Reach && i < n - Reach;
    for (int k = 0; k <= 2 * Reach; ++k) {
      int j = i + k - Reach;
      if (!inside) j = j < 0 ? j + n : j >= n ? j - n : j;
      dv += stencil.first[static_cast<std::size_t>(k)] * z[j];
      da += stencil.second[static_cast<std::size_t>(k)] * z[j];
    }
    v[i] = rate * dv;
    a[i] = square * da;
  }
}

}  // namespace

SHAKER_SIMD_CLONES void difference_lanes(int n, const Stencil& stencil, const Lanes& rate,
                                         const Lanes* z, Lanes* v, Lanes* a) {
  if (stencil.reach == 3)
    difference<3>(n, stencil, rate, z, v, a);
  else if (stencil.reach == 2)
    difference<2>(n, stencil, rate, z, v, a);
  else
    difference<1>(n, stencil, rate, z, v, a);
}

namespace {

// Adds the products of one datum to `sums`.
SHAKER_INLINE void add_datum(const LaneGram& gram, int width, int j, Lanes* sums) {
  const std::size_t point = static_cast<std::size_t>(j) * static_cast<std::size_t>(gram.every);
  const Lanes* row = gram.rows + point * static_cast<std::size_t>(gram.row);
  const Lanes residual = gram.data[j] - gram.z[point] - row[0];
  *sums++ += residual * residual;
  for (int k = 1; k < width; ++k) {
    *sums++ += row[k] * residual;
    for (int l = 1; l <= k; ++l)
      *sums++ += row[k] * row[l];
  }
}

// Keeps the sums in registers, for a width known at compile time.
template <int Width>
SHAKER_INLINE void sum_products(const LaneGram& gram) {
  constexpr int kSize = Width * (Width + 1) / 2;
  Lanes sums[kSize] = {};
  for (int j = 0; j < gram.count; ++j)
    add_datum(gram, Width, j, sums);
  for (int m = 0; m < kSize; ++m)
    gram.products[m] = sums[m];
}

}  // namespace

SHAKER_SIMD_CLONES void sum_lane_products(const LaneGram& gram) {
  if (gram.width == kOleoWidth) return sum_products<kOleoWidth>(gram);
  for (int m = 0; m < gram.width * (gram.width + 1) / 2; ++m)
    gram.products[m] = Lanes{};
  for (int j = 0; j < gram.count; ++j)
    add_datum(gram, gram.width, j, gram.products);
}

SHAKER_SIMD_CLONES void advance_lanes(const LaneAdvance& move) {
  const Lanes* row = move.rows;
  const Lanes share = *move.share;
  Lanes step{};
  Lanes size{};
  for (int i = 0; i < move.n; ++i, row += move.row) {
    Lanes sum = row[0];
    keep_largest(step, sum);
    keep_largest(size, move.z[i]);
    for (int k = 1; k < move.width; ++k)
      sum += move.delta[k - 1] * row[k];
    move.z[i] += share * sum;
  }
  *move.newton_step = step / (size + 1e-300);
}

}  // namespace shaker::estimator
