// Rings of one unknown a point.
#include <cmath>
#include <cstddef>

#include "estimator/math/lanes.hpp"
#include "estimator/solve/periodic/internal/ring_border.hpp"

namespace shaker::estimator {
namespace {

// The rows behind an elimination (upwards or downwards along the ring) that it still needs. They
// stay in registers because reading them back from memory would wait for the stores. They start as
// zeros.
template <int Reach, int Groups>
struct Chain {
  double u[Reach][Reach] = {};  // u[k - 1][j - 1]: entry j ahead of the row k behind
  Lanes r[Reach][Groups] = {};  // r[k - 1]: right-hand sides of that row
};

template <int Reach, int Groups>
SHAKER_INLINE void push(Chain<Reach, Groups>& chain) {
  for (int k = Reach - 1; k >= 1; --k) {
    for (int j = 0; j < Reach; ++j)
      chain.u[k][j] = chain.u[k - 1][j];
    for (int w = 0; w < Groups; ++w)
      chain.r[k][w] = chain.r[k - 1][w];
  }
}

// Eliminates the rows behind row i from its equation. c[Reach + k] is its coefficient k rows ahead:
// of row i + k for Ahead = 1, of row i - k for Ahead = -1. Returns false when the pivot is too
// small.
template <int Reach, int Groups, int Ahead>
SHAKER_INLINE bool eliminate(const RingStep& step, int i, double (&c)[2 * Reach + 1],
                             Lanes (&row)[Groups], Chain<Reach, Groups>& behind) {
  const double largest = std::fabs(step.band[8 * i + Reach]);
  for (int k = Reach; k >= 1; --k) {
    const double l = c[Reach - k];
    for (int j = 1; j <= Reach; ++j)
      c[Reach - k + j] -= l * behind.u[k - 1][j - 1];
    for (int w = 0; w < Groups; ++w)
      row[w] -= l * behind.r[k - 1][w];
  }
  const double inverse = 1.0 / c[Reach];
  push(behind);
  Lanes* rows = reinterpret_cast<Lanes*>(step.rows);
  for (int j = 1; j <= Reach; ++j)
    step.upper[4 * i + j] = behind.u[0][j - 1] = c[Reach + j] * inverse;
  for (int w = 0; w < Groups; ++w)
    rows[i * Groups + w] = behind.r[0][w] = row[w] * inverse;
  return std::fabs(c[Reach]) > kSmallestPivot * largest;
}

template <int Reach, int Groups, int Ahead>
SHAKER_INLINE bool eliminate(const RingStep& step, int i, Chain<Reach, Groups>& behind) {
  double c[2 * Reach + 1];
  for (int k = -Reach; k <= Reach; ++k)
    c[Reach + k] = step.band[8 * i + Reach + Ahead * k];
  Lanes row[Groups];
  for (int w = 0; w < Groups; ++w)
    row[w] = reinterpret_cast<Lanes*>(step.rows)[i * Groups + w];
  return eliminate<Reach, Groups, Ahead>(step, i, c, row, behind);
}

// Eliminates a row where both eliminations meet: first the rows after `last`, then those before it.
template <int Reach, int Groups>
SHAKER_INLINE bool eliminate_between(const RingStep& step, int i, int last,
                                     const Chain<Reach, Groups>& above,
                                     Chain<Reach, Groups>& below) {
  double c[2 * Reach + 1];
  for (int k = 0; k <= 2 * Reach; ++k)
    c[k] = step.band[8 * i + k];
  Lanes row[Groups];
  for (int w = 0; w < Groups; ++w)
    row[w] = reinterpret_cast<Lanes*>(step.rows)[i * Groups + w];
  for (int k = Reach; i + k > last; --k) {
    const int back = i + k - last - 1;  // in `above`
    const double l = c[Reach + k];
    c[Reach + k] = 0.0;
    for (int j = 1; j <= Reach; ++j)
      c[Reach + k - j] -= l * above.u[back][j - 1];
    for (int w = 0; w < Groups; ++w)
      row[w] -= l * above.r[back][w];
  }
  return eliminate<Reach, Groups, 1>(step, i, c, row, below);
}

// Computes the solution of row i from those of the rows ahead of it, `ahead.r`.
template <int Reach, int Groups>
SHAKER_INLINE void substitute(const RingStep& step, int i, Chain<Reach, Groups>& ahead) {
  Lanes* rows = reinterpret_cast<Lanes*>(step.rows);
  Lanes row[Groups];
  for (int w = 0; w < Groups; ++w)
    row[w] = rows[i * Groups + w];
  for (int j = Reach; j >= 1; --j) {
    for (int w = 0; w < Groups; ++w)
      row[w] -= step.upper[4 * i + j] * ahead.r[j - 1][w];
  }
  for (int k = Reach - 1; k >= 1; --k) {
    for (int w = 0; w < Groups; ++w)
      ahead.r[k][w] = ahead.r[k - 1][w];
  }
  for (int w = 0; w < Groups; ++w)
    rows[i * Groups + w] = ahead.r[0][w] = row[w];
}

// Solves the band of the first `inner` unknowns from both ends towards the middle and back. An
// elimination mostly waits for its own last pivot; two at the same time wait no longer than one.
template <int Reach, int Groups>
SHAKER_INLINE bool solve_inner(const RingStep& step, int inner) {
  const int middle = (inner - Reach) / 2;  // the first of the Reach rows where both meet
  const int last = middle + Reach - 1;
  Chain<Reach, Groups> up;
  Chain<Reach, Groups> down;
  bool sound = true;
  for (int i = 0; i < middle; ++i) {
    sound &= eliminate<Reach, Groups, 1>(step, i, up);
    sound &= eliminate<Reach, Groups, -1>(step, inner - 1 - i, down);
  }
  if (inner - 1 - middle > last) sound &= eliminate<Reach, Groups, -1>(step, last + 1, down);
  for (int i = middle; i <= last; ++i)
    sound &= eliminate_between<Reach, Groups>(step, i, last, down, up);
  if (!sound) return false;

  Chain<Reach, Groups> down_again;
  for (int i = last; i >= middle; --i)
    substitute<Reach, Groups>(step, i, down_again);
  Chain<Reach, Groups> up_again;
  for (int k = 0; k < Reach; ++k) {
    for (int w = 0; w < Groups; ++w)
      up_again.r[k][w] = down_again.r[Reach - 1 - k][w];
  }
  if (inner - 1 - middle > last) substitute<Reach, Groups>(step, last + 1, up_again);
  for (int i = middle - 1; i >= 0; --i) {
    substitute<Reach, Groups>(step, i, down_again);
    substitute<Reach, Groups>(step, inner - 1 - i, up_again);
  }
  return true;
}

template <int Reach, int Groups>
SHAKER_INLINE bool solve(const RingStep& step) {
  const int inner = step.n - Reach;  // points that are not the border
  constexpr FixedShape<1, Reach, Groups> kShape;
  fill_border(kShape, step, inner);
  return solve_inner<Reach, Groups>(step, inner) && close_border(kShape, step, inner);
}

#define SHAKER_RING_STEP(REACH, GROUPS)                                 \
  SHAKER_SIMD_CLONES bool solve_##REACH##_##GROUPS(const RingStep& s) { \
    return solve<REACH, GROUPS>(s);                                     \
  }
SHAKER_RING_STEP(1, 1)
SHAKER_RING_STEP(1, 2)
SHAKER_RING_STEP(1, 3)
SHAKER_RING_STEP(1, 4)
SHAKER_RING_STEP(2, 1)
SHAKER_RING_STEP(2, 2)
SHAKER_RING_STEP(2, 3)
SHAKER_RING_STEP(2, 4)
SHAKER_RING_STEP(3, 1)
SHAKER_RING_STEP(3, 2)
SHAKER_RING_STEP(3, 3)
SHAKER_RING_STEP(3, 4)
#undef SHAKER_RING_STEP

using Solve = bool (*)(const RingStep&);
constexpr Solve kSolve[3][4] = {{solve_1_1, solve_1_2, solve_1_3, solve_1_4},
                                {solve_2_1, solve_2_2, solve_2_3, solve_2_4},
                                {solve_3_1, solve_3_2, solve_3_3, solve_3_4}};

}  // namespace

bool solve_ring_step(const RingStep& step) {
  if (step.block > 1) return solve_block_step(step);
  return kSolve[step.reach - 1][step.groups - 1](step);
}

}  // namespace shaker::estimator
