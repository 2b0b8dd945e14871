// Cholesky for eight small matrices side by side, one a SIMD lane: the normal equations of eight
// estimates. Packed lower triangles, entry (k, l) at [k (k + 1) / 2 + l].
#pragma once

#include "estimator/math/lanes.hpp"

namespace shaker::estimator {

constexpr int packed(int k, int l) {
  return k * (k + 1) / 2 + l;
}

// A = L L^T in place; the diagonal of L is stored as its inverse. A bit for each lane whose pivots
// all kept more than 1e-13 of their diagonal; the others are of no use.
unsigned factorise_lanes(int size, Lanes* matrix);
// A x = b in place.
void substitute_lanes(int size, const Lanes* factor, Lanes* b);
// The diagonal of A^-1; `scratch` holds `size` Lanes.
void inverse_diagonal_lanes(int size, const Lanes* factor, Lanes* scratch, Lanes* diagonal);

}  // namespace shaker::estimator
