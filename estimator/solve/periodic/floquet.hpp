// Stability of a periodic solution: Floquet multipliers, the factors by which small disturbances
// grow over one period. If all are inside the unit circle, the rig settles on this solution. If one
// is outside, it does not, although Newton's method finds the solution as easily as any other.
//
// The variational equation
//
//     g_a du'' + g_v du' + g_u du = 0,   partial derivatives of (5.15) along the solution,
//
// is integrated over one period by three-stage Radau IIA (order 5, stiffly accurate). There is one
// step for each interval of the grid; it is halved where its error is too large (at the kink of
// |v| v). The eigenvalues of the resulting monodromy matrix are the multipliers. A coordinate has
// two multipliers. One without mass (no u'' in any equation: an internal state, or the node between
// a spring and a damper) has one, and one that occurs only algebraically has none.
#pragma once

#include <complex>
#include <span>
#include <vector>

#include "base/result.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator {

struct Floquet {
  std::vector<std::complex<double>> multipliers;  // largest modulus first
  double error = 0.0;                             // estimated absolute error of the integration

  double largest() const { return multipliers.empty() ? 0.0 : std::abs(multipliers.front()); }
  bool stable() const { return largest() < 1.0; }
};

// Computes the multipliers of the solution in `system`, which must be linearised at `theta`. They
// refer to the whole ring: to m periods of the excitation if the system spans m. `tolerance`: of
// the integration over the ring, absolute. Returns an error (not_converged) when the equations do
// not determine the highest derivatives. Allocates; takes 2 us for each point of the grid.
Result<Floquet> floquet(const PeriodicSystem& system, std::span<const double> theta,
                        double tolerance = 1e-9);

// A mode of disturbance: in the k-th period it is the real part of any complex number times
// multiplier^k times `shape`. A conjugate pair is given once.
struct FloquetMode {
  std::complex<double> multiplier;
  std::vector<std::complex<double>> shape;  // of the observed coordinate, one value a grid point
};

// Computes the modes, the largest modulus first. The contract is that of floquet().
Result<std::vector<FloquetMode>> floquet_modes(const PeriodicSystem& system,
                                               std::span<const double> theta,
                                               double tolerance = 1e-6);

}  // namespace shaker::estimator
