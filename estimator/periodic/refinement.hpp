// From the solution on one ring of points to a start on another one.
//
// Between two points it is the quintic of state, velocity and acceleration at both. It looks no
// further than they are, so that the kinks elsewhere leave it alone (a jump of u'''' between the
// two is worth a hundredth of what it does to the cubic through four points), and the second
// differences on the new ring, which is where the residual feels an error of a start, are nearly
// right from the beginning: a Newton step less.
#pragma once

#include "estimator/math/lanes.hpp"

namespace shaker::estimator {

// Of the values at both ends, of the velocities and accelerations in units of the step.
struct QuinticWeights {
  double left, right, left_slope, right_slope, left_bend, right_bend;
};

// `t` of the way from one point to the next.
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

// A ring of `points`, `step` seconds apart; u, v, a hold the first point's value again behind the
// last one's.
struct CoarseRing {
  int points = 0;
  double step = 0.0;
  const double *u = nullptr, *v = nullptr, *a = nullptr;
};
void refine(const CoarseRing& coarse, int points, double* z);

// The same abreast, a Lanes a point and a step for each lane; nothing behind the last point.
struct CoarseLanes {
  int points = 0;
  Lanes step{};
  const Lanes *u = nullptr, *v = nullptr, *a = nullptr;
};
void refine_lanes(const CoarseLanes& coarse, int points, Lanes* z);

}  // namespace shaker::estimator
