// Solves the linearised equations of a model on a cyclic grid, for the Newton step and all
// sensitivities together. This is the hot loop of every estimate. A point has one unknown or a
// block of two to four (coordinates and internal states).
//
// The cyclic band is solved by bordering: the unknowns of the last `reach` points are the border;
// the rest is an ordinary band. It is eliminated without row exchanges. One unknown a point: from
// both ends towards the middle. Blocks: forwards only, because the differences of internal states
// are biased backwards, and what grows backwards in time then decays. All right-hand sides (Newton
// step, sensitivities, border) are lanes of one SIMD row. If elimination makes a pivot too small,
// the solver fails, and the caller uses CyclicBandedLu (with row exchanges) instead.
//
// Nothing here allocates or throws.
#pragma once

#include "estimator/math/lanes.hpp"
#include "estimator/solve/periodic/scheme.hpp"

namespace shaker::estimator {

inline constexpr int kMostGroups = 4;  // more lane groups are not supported here

// Lane groups that `width` right-hand sides and the border's columns need. Blocks have solvers for
// few sizes only, because each costs seconds of compile time.
constexpr int lane_groups(int width, int reach, int block = 1) {
  const int groups = (width + reach * block + kLanes - 1) / kLanes;
  if (block == 1 || groups > kMostGroups) return groups;
  return block < 4 && groups <= 2 ? 2 : kMostGroups;
}

inline constexpr int kMostBlock = 4;  // nor are larger blocks

// Places that the unknowns of a block take in `band` and `upper`: whole SIMD registers.
constexpr int packed(int block) {
  return block > 2 ? 4 : block;
}
// True if solve_ring_step has a solver for this shape.
constexpr bool ring_step_exists(int block, int reach, int groups) {
  return groups <= kMostGroups && (block == 1 || (block <= kMostBlock && reach > 1));
}

struct RingStep {
  int n = 0;       // points, >= 3 reach + 1
  int reach = 0;   // 1, 2 or 3
  int width = 0;   // right-hand sides: 1 + parameters
  int groups = 0;  // lane_groups(width, reach, block)
  // Row r = i block + d is equation d of point i. In `band` it has 8 packed(block) places:
  // coefficient of unknown e of point i + k at [(reach + k) packed(block) + e].
  const double* band = nullptr;
  double* upper = nullptr;  // scratch, n block rows of 4 packed(block)
  double* rows = nullptr;   // n block rows of groups * 8, 64-byte aligned. In: right-hand sides in
                            // the first `width` lanes, zeros after them. Out: the solutions
  int block = 1;            // unknowns of a point
};

// Returns false when a pivot is too small for elimination without exchanges; `rows` is then
// invalid.
bool solve_ring_step(const RingStep& step);
bool solve_block_step(const RingStep& step);  // the same for block > 1

// Fills the band of blocks. g_u, g_v, g_a: arrays of n, equation by equation, as Model::evaluate
// fills them. first, second: of each unknown's stencil, `kMostAcross` values, in 1/s and 1/s^2.
struct BlockBand {
  int n = 0, block = 0, reach = 0;
  const double *const *g_u = nullptr, *const *g_v = nullptr, *const *g_a = nullptr;
  const double (*first)[kMostAcross] = nullptr, (*second)[kMostAcross] = nullptr;
  double* band = nullptr;
};
void fill_block_band(const BlockBand& band);

// Fills the rows of one equation of all points with minus the columns of `left`: the residual, then
// its derivatives over the parameters.
struct RingRows {
  int n = 0, width = 0, groups = 0;
  const double* const* left = nullptr;  // `width` arrays of n, readable up to a multiple of 8
  double* rows = nullptr;               // that equation's row of the first point
  int block = 1;                        // the next point's row is so many rows ahead
};
void fill_ring_rows(const RingRows& rows);

// z += newton * (Newton step) + sum delta[k] * (sensitivity k). Returns the largest Newton step of
// the observed unknown of the points, relative to its largest |z| before.
struct RingAdvance {
  int n = 0, width = 0, groups = 0;  // n: rows, of all unknowns
  double newton = 0.0;
  const double *rows = nullptr, *delta = nullptr;
  double* z = nullptr;
  int block = 1, observed = 0;
};
double advance_ring(const RingAdvance& move);

// Sums of products over data at grid points 0, every, 2 every, .... With
// e = (residual, dz/dtheta_1, ...), adds weight * sum e e^T to `products`, a full square matrix of
// 1 + parameters rows.
struct GramSum {
  int count = 0, every = 1, parameters = 0, groups = 1;
  bool with_newton = false;       // the residual includes the Newton step of z
  const double* rows = nullptr;   // as solved
  const double* state = nullptr;  // z
  const double* data = nullptr;
  double weight = 1.0;
  double* products = nullptr;
};
void add_products(const GramSum& sum);

}  // namespace shaker::estimator
