// Cholesky factorisation of eight small matrices, one in each SIMD lane: the normal equations of
// eight estimates. Matrices are packed lower triangles with entry (k, l) at [k (k + 1) / 2 + l].
#pragma once

#include "estimator/math/lanes.hpp"

namespace shaker::estimator {

constexpr int packed(int k, int l) {
  return k * (k + 1) / 2 + l;
}

// A = L L^T in place; the diagonal of L is stored as its inverse. Returns a bit for each lane
// whose pivots all exceed 1e-13 of their diagonal element. The other lanes are invalid.
unsigned factorise_lanes(int size, Lanes* matrix);
// Solves A x = b in place.
void substitute_lanes(int size, const Lanes* factor, Lanes* b);
// The diagonal of A^-1; `scratch` holds `size` Lanes.
void inverse_diagonal_lanes(int size, const Lanes* factor, Lanes* scratch, Lanes* diagonal);

}  // namespace shaker::estimator
