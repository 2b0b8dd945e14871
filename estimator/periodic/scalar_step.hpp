// Solves the linearised equations of a model with one coordinate on a cyclic grid, for the Newton
// step and all sensitivities together. This is the hot loop of every estimate.
//
// The cyclic band is solved by bordering: the last `reach` unknowns are the border; the rest is an
// ordinary band. It is eliminated without row exchanges, from both ends towards the middle. All
// right-hand sides (Newton step, sensitivities, border) are lanes of one SIMD row. If elimination
// makes a pivot too small, the solver fails, and the caller uses CyclicBandedLu (with row
// exchanges) instead.
//
// Nothing here allocates or throws.
#pragma once

#include "estimator/math/lanes.hpp"

namespace shaker::estimator {

// Lane groups that `width` right-hand sides and `reach` border columns need.
constexpr int lane_groups(int width, int reach) {
  return (width + reach + kLanes - 1) / kLanes;
}

inline constexpr int kMostGroups = 4;  // more lane groups are not supported here

struct ScalarStep {
  int n = 0;                     // points, >= 3 reach + 1
  int reach = 0;                 // 1, 2 or 3
  int width = 0;                 // right-hand sides: 1 + parameters
  int groups = 0;                // lane_groups(width, reach)
  const double* band = nullptr;  // n rows of 8: coefficient of z_{i+k} at [8 i + reach + k]
  double* upper = nullptr;       // scratch, n rows of 4
  double* rows = nullptr;  // n rows of groups * 8, 64-byte aligned. In: right-hand sides in the
                           // first `width` lanes, zeros after them. Out: the solutions
};

// Returns false when a pivot is too small for elimination without exchanges; `rows` is then
// invalid.
bool solve_scalar_step(const ScalarStep& step);

// Fills the rows of a step with minus the columns of `left`: the residual, then its derivatives
// over the parameters.
struct ScalarRows {
  int n = 0, width = 0, groups = 0;
  const double* const* left = nullptr;  // `width` arrays of n, readable up to a multiple of 8
  double* rows = nullptr;
};
void fill_scalar_rows(const ScalarRows& rows);

// z += newton * (Newton step) + sum delta[k] * (sensitivity k). Returns the largest Newton step
// relative to the largest |z| before.
struct ScalarAdvance {
  int n = 0, width = 0, groups = 0;
  double newton = 0.0;
  const double *rows = nullptr, *delta = nullptr;
  double* z = nullptr;
};
double advance_scalar(const ScalarAdvance& move);

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
