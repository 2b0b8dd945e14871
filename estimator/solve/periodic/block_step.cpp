// Rings of blocks: two to four unknowns a point.
#include <array>
#include <cmath>
#include <cstddef>

#include "estimator/math/lanes.hpp"
#include "estimator/solve/periodic/internal/ring_border.hpp"

// The loops over a block. g++ keeps their arrays in registers only if it unrolls all of them.
#if defined(__clang__)
#define SHAKER_UNROLLED
#else
#define SHAKER_UNROLLED _Pragma("GCC unroll 8")
#endif

namespace shaker::estimator {
namespace {

// The coefficients of a block's unknowns in one equation.
template <int Block>
struct PackedBlock;
template <>
struct PackedBlock<2> {
  typedef double Type __attribute__((vector_size(16)));
};
template <>
struct PackedBlock<3> {
  typedef double Type __attribute__((vector_size(32)));
};
template <>
struct PackedBlock<4> : PackedBlock<3> {};

template <int Block, int Reach, int Groups>
struct BlockSolver {
  using Packed = typename PackedBlock<Block>::Type;
  static constexpr int kAcross = 2 * Reach + 1;
  const RingStep& step;

  SHAKER_INLINE const Packed* band(int i, int d) const {
    return reinterpret_cast<const Packed*>(step.band) +
           static_cast<std::ptrdiff_t>(i * Block + d) * 8;
  }
  SHAKER_INLINE Packed* upper(int i, int d) const {
    return reinterpret_cast<Packed*>(step.upper) + static_cast<std::ptrdiff_t>(i * Block + d) * 4;
  }
  SHAKER_INLINE Lanes* row(int i, int d) const {
    return reinterpret_cast<Lanes*>(step.rows) +
           static_cast<std::ptrdiff_t>(i * Block + d) * Groups;
  }

  // Subtracts the rows of point i - k, already eliminated, from those of point i.
  template <int Back>
  SHAKER_INLINE void subtract(int i, Packed (&c)[Block][kAcross],
                              Lanes (&rows)[Block][Groups]) const {
    SHAKER_UNROLLED
    for (int e = 0; e < Block; ++e) {
      const Packed* ahead = upper(i - Back, e);
      const Lanes* known = row(i - Back, e);
      SHAKER_UNROLLED
      for (int d = 0; d < Block; ++d) {
        const double l = c[d][Reach - Back][e];
        SHAKER_UNROLLED
        for (int j = 1; j <= Reach; ++j)
          c[d][Reach - Back + j] -= l * ahead[j];
        SHAKER_UNROLLED
        for (int w = 0; w < Groups; ++w)
          rows[d][w] -= l * known[w];
      }
    }
  }

  // Eliminates the rows behind point i from its equations, and its own unknowns among them.
  // Returns false when a pivot is too small.
  SHAKER_INLINE bool eliminate(int i) const {
    Packed c[Block][kAcross];
    Lanes rows[Block][Groups];
    double largest[Block];
    SHAKER_UNROLLED
    for (int d = 0; d < Block; ++d) {
      SHAKER_UNROLLED
      for (int k = 0; k < kAcross; ++k)
        c[d][k] = band(i, d)[k];
      SHAKER_UNROLLED
      for (int w = 0; w < Groups; ++w)
        rows[d][w] = row(i, d)[w];
      largest[d] = std::fabs(c[d][Reach][d]);
    }
    if constexpr (Reach > 2) {
      if (i > 2) subtract<3>(i, c, rows);
    }
    if (i > 1) subtract<2>(i, c, rows);
    if (i > 0) subtract<1>(i, c, rows);
    bool sound = true;
    SHAKER_UNROLLED
    for (int e = 0; e < Block; ++e) {
      const double pivot = c[e][Reach][e];
      sound &= std::fabs(pivot) > kSmallestPivot * largest[e];
      const double inverse = 1.0 / pivot;
      SHAKER_UNROLLED
      for (int j = 0; j <= Reach; ++j)
        c[e][Reach + j] *= inverse;
      SHAKER_UNROLLED
      for (int w = 0; w < Groups; ++w)
        rows[e][w] *= inverse;
      SHAKER_UNROLLED
      for (int d = 0; d < Block; ++d) {
        if (d == e) continue;
        const double l = c[d][Reach][e];
        SHAKER_UNROLLED
        for (int j = 0; j <= Reach; ++j)
          c[d][Reach + j] -= l * c[e][Reach + j];
        SHAKER_UNROLLED
        for (int w = 0; w < Groups; ++w)
          rows[d][w] -= l * rows[e][w];
      }
    }
    SHAKER_UNROLLED
    for (int d = 0; d < Block; ++d) {
      SHAKER_UNROLLED
      for (int j = 1; j <= Reach; ++j)
        upper(i, d)[j] = c[d][Reach + j];
      SHAKER_UNROLLED
      for (int w = 0; w < Groups; ++w)
        row(i, d)[w] = rows[d][w];
    }
    return sound;
  }

  // Computes the solution of point i from those of the `ahead` points after it.
  SHAKER_INLINE void substitute(int i, int ahead) const {
    Lanes rows[Block][Groups];
    SHAKER_UNROLLED
    for (int d = 0; d < Block; ++d) {
      SHAKER_UNROLLED
      for (int w = 0; w < Groups; ++w)
        rows[d][w] = row(i, d)[w];
    }
    for (int j = ahead; j >= 1; --j) {
      SHAKER_UNROLLED
      for (int e = 0; e < Block; ++e) {
        const Lanes* known = row(i + j, e);
        SHAKER_UNROLLED
        for (int d = 0; d < Block; ++d) {
          const double u = upper(i, d)[j][e];
          SHAKER_UNROLLED
          for (int w = 0; w < Groups; ++w)
            rows[d][w] -= u * known[w];
        }
      }
    }
    SHAKER_UNROLLED
    for (int d = 0; d < Block; ++d) {
      SHAKER_UNROLLED
      for (int w = 0; w < Groups; ++w)
        row(i, d)[w] = rows[d][w];
    }
  }

  SHAKER_INLINE bool solve_inner(int inner) const {
    bool sound = true;
    for (int i = 0; i < inner; ++i)
      sound &= eliminate(i);
    if (!sound) return false;
    for (int i = inner - 2; i >= inner - Reach; --i)
      substitute(i, inner - 1 - i);
    for (int i = inner - Reach - 1; i >= 0; --i)
      substitute(i, Reach);
    return true;
  }
};

template <int Block, int Reach>
SHAKER_INLINE void fill_blocks(const BlockBand& in) {
  using Packed = typename PackedBlock<Block>::Type;
  Packed first[2 * Reach + 1] = {}, second[2 * Reach + 1] = {};
  for (int k = 0; k <= 2 * Reach; ++k) {
    for (int e = 0; e < Block; ++e) {
      first[k][e] = in.first[e][k];
      second[k][e] = in.second[e][k];
    }
  }
  Packed* row = reinterpret_cast<Packed*>(in.band);
  for (int i = 0; i < in.n; ++i) {
    for (int d = 0; d < Block; ++d, row += 8) {
      Packed over_u = {}, over_v = {}, over_a = {};
      for (int e = 0; e < Block; ++e) {
        over_u[e] = in.g_u[d * Block + e][i];
        over_v[e] = in.g_v[d * Block + e][i];
        over_a[e] = in.g_a[d * Block + e][i];
      }
      for (int k = 0; k <= 2 * Reach; ++k)
        row[k] = over_a * second[k] + over_v * first[k];
      row[Reach] += over_u;
    }
  }
}

#define SHAKER_SOLVE_INNER(BLOCK, REACH, GROUPS)                                                   \
  SHAKER_SIMD_CLONES bool solve_inner_##BLOCK##_##REACH##_##GROUPS(const RingStep& s, int inner) { \
    return BlockSolver<BLOCK, REACH, GROUPS>{s}.solve_inner(inner);                                \
  }
#define SHAKER_BLOCKS(BLOCK, REACH)                                                      \
  SHAKER_SIMD_CLONES void fill_band_##BLOCK##_##REACH(const BlockBand& band) {           \
    fill_blocks<BLOCK, REACH>(band);                                                     \
  }                                                                                      \
  SHAKER_SIMD_CLONES void fill_border_##BLOCK##_##REACH(const RingStep& s, int inner) {  \
    fill_border(Shape<BLOCK, REACH>{s.groups}, s, inner);                                \
  }                                                                                      \
  SHAKER_SIMD_CLONES bool close_border_##BLOCK##_##REACH(const RingStep& s, int inner) { \
    return close_border(Shape<BLOCK, REACH>{s.groups}, s, inner);                        \
  }                                                                                      \
  SHAKER_SOLVE_INNER(BLOCK, REACH, 4)
SHAKER_BLOCKS(2, 2)
SHAKER_BLOCKS(2, 3)
SHAKER_BLOCKS(3, 2)
SHAKER_BLOCKS(3, 3)
SHAKER_BLOCKS(4, 2)
SHAKER_BLOCKS(4, 3)
SHAKER_SOLVE_INNER(2, 2, 2)
SHAKER_SOLVE_INNER(2, 3, 2)
SHAKER_SOLVE_INNER(3, 2, 2)
SHAKER_SOLVE_INNER(3, 3, 2)
#undef SHAKER_BLOCKS
#undef SHAKER_SOLVE_INNER

struct BlockFunctions {
  void (*fill_band)(const BlockBand& band);
  void (*fill_border)(const RingStep& step, int inner);
  bool (*solve_inner[2])(const RingStep& step, int inner);  // with two groups, with four
  bool (*close_border)(const RingStep& step, int inner);
};
#define SHAKER_FUNCTIONS(BLOCK, REACH, TWO_GROUPS)                                      \
  {                                                                                     \
    fill_band_##BLOCK##_##REACH, fill_border_##BLOCK##_##REACH,                         \
        {TWO_GROUPS, solve_inner_##BLOCK##_##REACH##_4}, close_border_##BLOCK##_##REACH \
  }
// By block and reach.
constexpr BlockFunctions kBlocks[3][2] = {
    {SHAKER_FUNCTIONS(2, 2, solve_inner_2_2_2), SHAKER_FUNCTIONS(2, 3, solve_inner_2_3_2)},
    {SHAKER_FUNCTIONS(3, 2, solve_inner_3_2_2), SHAKER_FUNCTIONS(3, 3, solve_inner_3_3_2)},
    {SHAKER_FUNCTIONS(4, 2, nullptr), SHAKER_FUNCTIONS(4, 3, nullptr)}};
#undef SHAKER_FUNCTIONS

}  // namespace

bool solve_block_step(const RingStep& step) {
  const BlockFunctions& of = kBlocks[step.block - 2][step.reach - 2];
  const int inner = step.n - step.reach;
  of.fill_border(step, inner);
  return of.solve_inner[step.groups / 2 - 1](step, inner) && of.close_border(step, inner);
}

void fill_block_band(const BlockBand& band) {
  kBlocks[band.block - 2][band.reach - 2].fill_band(band);
}

}  // namespace shaker::estimator
