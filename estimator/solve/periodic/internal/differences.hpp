// Velocity and acceleration over the cyclic time by a stencil. Internal to the estimator.
#pragma once

#include "estimator/solve/periodic/scheme.hpp"

namespace shaker::estimator {

// Computes v = rate sum first u and a = rate^2 sum second u at the n points of the ring. `u` has
// room for `reach` values on either side; they are filled with the values of the ring's other end.
void take_differences(const Stencil& stencil, double rate, int n, double* u, double* v, double* a);

}  // namespace shaker::estimator
