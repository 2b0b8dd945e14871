// Eight linearised rings of equal length solved side by side: the elimination of scalar_step.hpp
// with a whole system in each SIMD lane, so that every operation is vertical and nothing waits for
// anything but its own lane.
//
//          inner unknowns      | border
//     [ x x x x               | b b b ]     One row of the matrix is a Lanes for each of its
//     [ x x x x x             |   b b ]     2 reach + 1 coefficients. They are not stored: they
//     [ x x x x x x           |     b ]     are made from g_u, g_v, g_a as they are met.
//     [ x x x x x x x         |       ]     The right-hand sides are eliminated along: the Newton
//     [       . . .           |       ]     step, the sensitivities, and the columns b as further
//     [         x x x x x x   | b     ]     right-hand sides. After the way down and up,
//     [           x x x x x   | b b   ]         inner = r - B border.
//     [             x x x x   | b b b ]     Put into the last rows, that leaves a reach x reach
//     [-----------------------+-------]     system for the border.
//     [ b b b           b b b | x x x ]
//
// No row exchanges: a lane whose pivot gets small against its row is reported as unsound.
#pragma once

#include "estimator/math/lanes.hpp"
#include "estimator/periodic/scheme.hpp"

namespace shaker::estimator {

// Right-hand sides of the oleo, whose loops are compiled for their number: the Newton step and the
// sensitivities over four parameters.
inline constexpr int kOleoWidth = 5;

struct LaneStep {
  int n = 0;      // points, >= 3 reach + 2
  int width = 0;  // right-hand sides: 1 + parameters
  Stencil stencil;
  Lanes rate{};                                                // frequency * n of each lane
  const Lanes *g_u = nullptr, *g_v = nullptr, *g_a = nullptr;  // a Lanes a point
  const double* const* left = nullptr;  // what the equations leave: minus the right-hand sides, an
                                        // array of n for each of `width`
  Lanes* upper = nullptr;               // scratch, n rows of reach
  Lanes* rows = nullptr;  // n rows of width + reach: the solutions in the first `width`
};

// Bit l is set when lane l is sound; the rows of other lanes are then of no use.
unsigned solve_lane_step(const LaneStep& step);

// Vertical differences over the ring of n points: v = rate sum first z, a = rate^2 sum second z.
void difference_lanes(int n, const Stencil& stencil, const Lanes& rate, const Lanes* z, Lanes* v,
                      Lanes* a);

// Per lane, over data at points 0, every, 2 every, ...: with e = (data - z - Newton step,
// dz/dtheta_1, ...) the lower triangle of sum e e^T into products[k (k + 1) / 2 + l], all
// overwritten.
struct LaneGram {
  int count = 0, every = 1, width = 0, row = 0;  // row: Lanes in a row
  const Lanes *rows = nullptr, *z = nullptr, *data = nullptr;
  Lanes* products = nullptr;
};
void sum_lane_products(const LaneGram& gram);

// z += share (row[0] + sum delta[k] row[1 + k]), share being 1 for lanes that move and 0 for
// others; the largest |row[0]| over the largest |z| of each lane goes to `newton_step`.
struct LaneAdvance {
  int n = 0, width = 0, row = 0;
  const Lanes *rows = nullptr, *delta = nullptr, *share = nullptr;
  Lanes *z = nullptr, *newton_step = nullptr;
};
void advance_lanes(const LaneAdvance& move);

}  // namespace shaker::estimator
