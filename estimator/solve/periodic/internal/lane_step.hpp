// Solves a batch of eight linearised rings with equally many points. The elimination is that of
// ring_step.hpp with one whole system in each SIMD lane: every operation acts lane by lane.
//
//          inner unknowns      | border
//     [ x x x x               | b b b ]     A row of the matrix has one Lanes for each of its
//     [ x x x x x             |   b b ]     2 reach + 1 coefficients. They are not stored but
//     [ x x x x x x           |     b ]     computed from g_u, g_v, g_a when they are needed.
//     [ x x x x x x x         |       ]     The right-hand sides are eliminated at the same time:
//     [       . . .           |       ]     the Newton step, the sensitivities, and the columns b
//     [         x x x x x x   | b     ]     as further right-hand sides. After elimination and
//     [           x x x x x   | b b   ]     substitution, inner = r - B border.
//     [             x x x x   | b b b ]     In the last rows this leaves a reach x reach system
//     [-----------------------+-------]     for the border.
//     [ b b b           b b b | x x x ]
//
// There are no row exchanges: a lane with a relatively small pivot is reported as unsound.
#pragma once

#include "estimator/math/lanes.hpp"
#include "estimator/solve/periodic/scheme.hpp"

namespace shaker::estimator {

// Right-hand sides of the oleo: the Newton step and the sensitivities over four parameters. The
// loops are compiled for this number.
inline constexpr int kOleoWidth = 5;

struct LaneStep {
  int n = 0;      // points, >= 3 reach + 2
  int width = 0;  // right-hand sides: 1 + parameters
  Stencil stencil;
  Lanes rate{};                                                // frequency * n of each lane
  const Lanes *g_u = nullptr, *g_v = nullptr, *g_a = nullptr;  // one Lanes for each point
  const double* const* left = nullptr;  // minus the right-hand sides: `width` arrays of n Lanes,
                                        // the residual first, then its derivatives over theta
  Lanes* upper = nullptr;               // scratch, n rows of reach
  Lanes* rows = nullptr;  // n rows of width + reach: the solutions in the first `width`
};

// Returns a mask in which bit l is set when lane l is sound. The rows of other lanes are undefined.
unsigned solve_lane_step(const LaneStep& step);

// Differences of each lane over the ring of n points: v = rate sum first z and
// a = rate^2 sum second z.
void difference_lanes(int n, const Stencil& stencil, const Lanes& rate, const Lanes* z, Lanes* v,
                      Lanes* a);

// Sums of products of each lane, over data at points 0, every, 2 every, .... With
// e = (data - z - Newton step, dz/dtheta_1, ...) the lower triangle of sum e e^T overwrites
// products[k (k + 1) / 2 + l].
struct LaneGram {
  int count = 0, every = 1, width = 0, row = 0;  // row: Lanes in a row
  const Lanes *rows = nullptr, *z = nullptr, *data = nullptr;
  Lanes* products = nullptr;
};
void sum_lane_products(const LaneGram& gram);

// z += share (row[0] + sum delta[k] row[1 + k]); share is 1 for lanes that move and 0 for others.
// `newton_step` gets max |row[0]| / max |z| of each lane, with z before the change.
struct LaneAdvance {
  int n = 0, width = 0, row = 0;
  const Lanes *rows = nullptr, *delta = nullptr, *share = nullptr;
  Lanes *z = nullptr, *newton_step = nullptr;
};
void advance_lanes(const LaneAdvance& move);

}  // namespace shaker::estimator
