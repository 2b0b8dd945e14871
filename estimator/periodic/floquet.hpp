// Stability of a periodic solution: Floquet multipliers, the factors by which small disturbances
// grow over one period. All inside the unit circle: the rig settles on this solution. One outside:
// it never does, though Newton's method finds the solution as easily as any other.
//
// The variational equation
//
//     g_a du'' + g_v du' + g_u du = 0,   partial derivatives of (5.15) along the solution,
//
// is integrated over one period by three-stage Radau IIA (order 5, stiffly accurate), one step for
// each interval of the grid, halved where the step's error wants it (at the kink of |v| v). The
// eigenvalues of the resulting monodromy matrix are the multipliers. A coordinate without mass (no
// u'' in any equation: an internal state, or the node between a spring and a damper) has one
// multiplier, one that stands only algebraically has none, and any other two.
#pragma once

#include <complex>
#include <span>
#include <vector>

#include "base/result.hpp"
#include "estimator/periodic/periodic_system.hpp"

namespace shaker::estimator {

struct Floquet {
  std::vector<std::complex<double>> multipliers;  // largest modulus first
  double error = 0.0;                             // bound of what the integration added, absolute

  double largest() const { return multipliers.empty() ? 0.0 : std::abs(multipliers.front()); }
  bool stable() const { return largest() < 1.0; }
};

// Of the solution in `system`, as last linearised at `theta`; over the whole cyclic time, so over m
// periods of the excitation when the system spans m. An error when the equations do not determine
// the highest derivatives. Allocates; 2 us for each point of the grid,
Result<Floquet> floquet(const PeriodicSystem& system, std::span<const double> theta,
                        double tolerance = 1e-9);

// A disturbance that only shrinks or grows: in the k-th period it is the real part of any complex
// number times multiplier^k times `shape`. Conjugate pairs are given once.
struct FloquetMode {
  std::complex<double> multiplier;
  std::vector<std::complex<double>> shape;  // of the observed coordinate, a value a grid point
};

// Largest modulus first; as floquet() otherwise.
Result<std::vector<FloquetMode>> floquet_modes(const PeriodicSystem& system,
                                               std::span<const double> theta,
                                               double tolerance = 1e-6);

}  // namespace shaker::estimator
