// Operations before and after solve_ring_step(): right-hand sides, sums of products, and the
// update of the state.
#include <cstddef>

#include "estimator/solve/periodic/ring_step.hpp"

namespace shaker::estimator {
namespace {

template <int Groups>
SHAKER_INLINE void sum_products(const GramSum& sum) {
  const int size = 1 + sum.parameters;
  Lanes total[kLanes * Groups][Groups];
  for (int k = 0; k < size; ++k) {
    for (int w = 0; w < Groups; ++w)
      total[k][w] = Lanes{};
  }
  for (int j = 0; j < sum.count; ++j) {
    const std::size_t point = static_cast<std::size_t>(j) * sum.every;
    const double* lanes = sum.rows + point * Groups * kLanes;
    const Lanes* row = reinterpret_cast<const Lanes*>(lanes);
    const double residual = sum.data[j] - sum.state[point] - (sum.with_newton ? lanes[0] : 0.0);
    Lanes own[Groups];
    for (int w = 0; w < Groups; ++w)
      own[w] = row[w];
    own[0][0] = residual;
    for (int w = 0; w < Groups; ++w)
      total[0][w] += residual * own[w];
    for (int k = 1; k < size; ++k) {
      for (int w = 0; w < Groups; ++w)
        total[k][w] += lanes[k] * own[w];
    }
  }
  for (int k = 0; k < size; ++k) {
    for (int l = 0; l < size; ++l)
      sum.products[k * size + l] += sum.weight * total[k][l / kLanes][l % kLanes];
  }
}

// Loads a Lanes of eight points for each column and transposes them into rows.
template <int Groups>
SHAKER_INLINE void turned_columns(const RingRows& in, int i, int group, Lanes (&block)[kLanes]) {
  for (int k = 0; k < kLanes; ++k) {
    const int column = group * kLanes + k;
    block[k] = column < in.width ? -as_lanes(in.left[column])[i / kLanes] : Lanes{};
  }
  transpose(block);
}

template <int Groups>
SHAKER_INLINE void fill_rows(const RingRows& in) {
  Lanes* rows = as_lanes(in.rows);
  int i = 0;
  for (; i + kLanes <= in.n; i += kLanes) {
    for (int w = 0; w < Groups; ++w) {
      Lanes block[kLanes];
      turned_columns<Groups>(in, i, w, block);
      for (int k = 0; k < kLanes; ++k)
        rows[(i + k) * in.block * Groups + w] = block[k];
    }
  }
  for (int w = 0; w < Groups && i < in.n; ++w) {
    Lanes block[kLanes];
    turned_columns<Groups>(in, i, w, block);
    for (int k = 0; i + k < in.n; ++k)
      rows[(i + k) * in.block * Groups + w] = block[k];
  }
}

SHAKER_INLINE double largest_lane(const Lanes& values) {
  double worst = values[0];
  for (int l = 1; l < kLanes; ++l)
    worst = values[l] > worst ? values[l] : worst;
  return worst;
}

// Advances eight unknowns. Their `rows` are transposed back to a Lanes of eight unknowns for each
// column. `observed` is 1 for those whose size counts, else 0; null: all count.
template <int Groups>
SHAKER_INLINE void advance_eight(const RingAdvance& move, const Lanes* observed, const Lanes* rows,
                                 Lanes& z, Lanes& step, Lanes& size) {
  keep_largest(size, observed != nullptr ? *observed * z : z);
  for (int w = 0; w < Groups; ++w) {
    Lanes block[kLanes];
    for (int k = 0; k < kLanes; ++k)
      block[k] = rows[k * Groups + w];
    transpose(block);
    if (w == 0) keep_largest(step, observed != nullptr ? *observed * block[0] : block[0]);
    for (int k = 0; k < kLanes; ++k) {
      const int column = w * kLanes + k;
      if (column < move.width) z += (column == 0 ? move.newton : move.delta[column - 1]) * block[k];
    }
  }
}

// `observed`: of unknowns i to i + 7 at i / 8 % block.
template <int Groups>
SHAKER_INLINE double advance(const RingAdvance& move, const Lanes* observed) {
  Lanes step{};
  Lanes size{};
  const Lanes* rows = as_lanes(move.rows);
  int i = 0, phase = 0;
  for (; i + kLanes <= move.n; i += kLanes) {
    advance_eight<Groups>(move, observed == nullptr ? nullptr : observed + phase, rows + i * Groups,
                          as_lanes(move.z)[i / kLanes], step, size);
    phase = phase + 1 < move.block ? phase + 1 : 0;
  }
  if (i < move.n) {
    Lanes last[kLanes * Groups] = {};
    Lanes z{};
    for (int k = 0; k < (move.n - i) * Groups; ++k)
      last[k] = rows[i * Groups + k];
    for (int k = i; k < move.n; ++k)
      z[k - i] = move.z[k];
    advance_eight<Groups>(move, observed == nullptr ? nullptr : observed + phase, last, z, step,
                          size);
    for (int k = i; k < move.n; ++k)
      move.z[k] = z[k - i];
  }
  return largest_lane(step) / (largest_lane(size) + 1e-300);
}

#define SHAKER_GRAM_SUM(GROUPS)                            \
  SHAKER_SIMD_CLONES void sum_##GROUPS(const GramSum& s) { \
    sum_products<GROUPS>(s);                               \
  }
SHAKER_GRAM_SUM(1)
SHAKER_GRAM_SUM(2)
SHAKER_GRAM_SUM(3)
SHAKER_GRAM_SUM(4)
#undef SHAKER_GRAM_SUM

#define SHAKER_ROWS(GROUPS)                                                     \
  SHAKER_SIMD_CLONES void fill_rows_##GROUPS(const RingRows& in) {              \
    fill_rows<GROUPS>(in);                                                      \
  }                                                                             \
  SHAKER_SIMD_CLONES double advance_##GROUPS(const RingAdvance& m) {            \
    if (m.block == 1) return advance<GROUPS>(m, nullptr);                       \
    Lanes observed[kMostBlock] = {};                                            \
    for (int i = 0; i < m.block * kLanes; ++i)                                  \
      observed[i / kLanes][i % kLanes] = i % m.block == m.observed ? 1.0 : 0.0; \
    return advance<GROUPS>(m, observed);                                        \
  }
SHAKER_ROWS(1)
SHAKER_ROWS(2)
SHAKER_ROWS(3)
SHAKER_ROWS(4)
#undef SHAKER_ROWS

}  // namespace

void fill_ring_rows(const RingRows& rows) {
  constexpr void (*kFill[4])(const RingRows&) = {fill_rows_1, fill_rows_2, fill_rows_3,
                                                 fill_rows_4};
  kFill[rows.groups - 1](rows);
}

double advance_ring(const RingAdvance& move) {
  constexpr double (*kAdvance[4])(const RingAdvance&) = {advance_1, advance_2, advance_3,
                                                         advance_4};
  return kAdvance[move.groups - 1](move);
}

void add_products(const GramSum& sum) {
  constexpr void (*kSum[4])(const GramSum&) = {sum_1, sum_2, sum_3, sum_4};
  kSum[sum.groups - 1](sum);
}

}  // namespace shaker::estimator
