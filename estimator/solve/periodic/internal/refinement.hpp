// Interpolation of a solution from one ring of points to another.
//
// Between two points the interpolant is the quintic through state, velocity and acceleration at
// both. It uses no other points, so kinks elsewhere do not affect it; a jump of u'''' between the
// two has a hundredth of the effect that it has on the cubic through four points. The second
// differences on the new ring dominate the residual; they are nearly right from the start, which
// saves a Newton step.
#pragma once

#include "estimator/math/lanes.hpp"

namespace shaker::estimator {

// Weights of the values at both ends, and of velocities and accelerations in units of the step.
struct QuinticWeights {
  double left, right, left_slope, right_slope, left_bend, right_bend;
};

// `t`: position between two points, from 0 to 1.
inline QuinticWeights quintic_weights(double t) {
  const double r = 1.0 - t;
  const double t3 = t * t * t, r3 = r * r * r;
  return {r3 * (10.0 - 15.0 * r + 6.0 * r * r),
          t3 * (10.0 - 15.0 * t + 6.0 * t * t),
          t * r3 * (1.0 + 3.0 * t),
          -r * t3 * (1.0 + 3.0 * r),
          0.5 * t * t * r3,
          0.5 * r * r * t3};
}

// A ring of `points`, `step` seconds apart. u, v, a have points + 1 values: the first value is
// repeated after the last one.
struct CoarseRing {
  int points = 0;
  double step = 0.0;
  const double *u = nullptr, *v = nullptr, *a = nullptr;
};
void refine(const CoarseRing& coarse, int points, double* z);

// The same for a batch: one Lanes for each point, one step for each lane, no repeated value.
struct CoarseLanes {
  int points = 0;
  Lanes step{};
  const Lanes *u = nullptr, *v = nullptr, *a = nullptr;
};
void refine_lanes(const CoarseLanes& coarse, int points, Lanes* z);

}  // namespace shaker::estimator
