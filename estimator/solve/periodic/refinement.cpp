#include "estimator/solve/periodic/internal/refinement.hpp"

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "estimator/solve/periodic/internal/differences.hpp"
#include "estimator/solve/periodic/internal/lane_step.hpp"
#include "estimator/solve/periodic/periodic_lanes.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator {
namespace {

// Position of point i of n in a ring of m: the preceding point, and the share of the step after it.
struct Place {
  int point;
  double share;
};

Place place_of(int i, int n, int m) {
  const auto at = static_cast<std::int64_t>(i) * m;
  return {static_cast<int>(at / n), static_cast<double>(at % n) / n};
}

SHAKER_INLINE QuinticWeights weights_at(double share, double step) {
  QuinticWeights w = quintic_weights(share);
  w.left_slope *= step;
  w.right_slope *= step;
  w.left_bend *= step * step;
  w.right_bend *= step * step;
  return w;
}

}  // namespace

// Points with the same position between those of the coarse ring share their weights.
SHAKER_SIMD_CLONES void refine(const CoarseRing& coarse, int points, double* z) {
  const int alike = std::gcd(points, coarse.points);
  const int apart = points / alike;
  const int step = coarse.points / alike;
  for (int i = 0; i < apart; ++i) {
    const Place place = place_of(i, points, coarse.points);
    const QuinticWeights w = weights_at(place.share, coarse.step);
    for (int k = 0; k < alike; ++k) {
      const int j = place.point + k * step;
      z[i + k * apart] = w.left * coarse.u[j] + w.right * coarse.u[j + 1] +
                         w.left_slope * coarse.v[j] + w.right_slope * coarse.v[j + 1] +
                         w.left_bend * coarse.a[j] + w.right_bend * coarse.a[j + 1];
    }
  }
}

SHAKER_SIMD_CLONES void refine_lanes(const CoarseLanes& coarse, int points, Lanes* z) {
  const Lanes step = coarse.step;
  const Lanes square = step * step;
  for (int i = 0; i < points; ++i) {
    const Place place = place_of(i, points, coarse.points);
    const QuinticWeights w = quintic_weights(place.share);
    const int j = place.point;
    const int next = j + 1 < coarse.points ? j + 1 : 0;
    z[i] = w.left * coarse.u[j] + w.right * coarse.u[next] +
           step * (w.left_slope * coarse.v[j] + w.right_slope * coarse.v[next]) +
           square * (w.left_bend * coarse.a[j] + w.right_bend * coarse.a[next]);
  }
}

void PeriodicSystem::interpolate_from(const PeriodicSystem& coarser) {
  begin();
  if (reversals_ && coarser.reversals_) {
    theta_ = coarser.theta_;
    model_->velocity_kink_gradient(theta_, &kappa_theta_[1]);
    const bool known = coarser.rows_hold_sensitivities_;
    reversals_->inherit(*coarser.reversals_, known ? coarser.rows_.data() : nullptr,
                        kappa_theta_.data());
  }
  if (s_ == 1 && coarser.n_ <= n_ && model_->order(0) == 2 && !dense_ && !coarser.dense_)
    interpolate_quintic(coarser);
  else
    interpolate_cubic(coarser);
}

// The coarser state may have changed since its last linearisation, so its velocities are computed
// again, in this system's arrays. Its velocity reversals are reused because they have hardly moved.
void PeriodicSystem::interpolate_quintic(const PeriodicSystem& coarser) {
  const int m = coarser.n_;
  const double rate = coarser.frequency_ * m;
  double *u = u_[0], *v = v_[0], *a = a_[0];
  std::copy_n(coarser.z_.begin(), m, u);
  take_differences(coarser.stencil_, rate, m, u, v, a);
  if (coarser.reversals_) coarser.reversals_->add_jumps(v, a);
  for (double* array : {u, v, a})
    array[m] = array[0];
  refine({m, 1.0 / rate, u, v, a}, n_, z_.data());
}

// Uses four-point Lagrange interpolation. Trigonometric interpolation would oscillate at the kinks.
void PeriodicSystem::interpolate_cubic(const PeriodicSystem& coarser) {
  const int m = coarser.n_;
  for (int i = 0; i < n_; ++i) {
    const auto [j, t] = place_of(i, n_, m);
    const double w[4] = {-t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2,
                         -(t + 1) * t * (t - 2) / 2, (t + 1) * t * (t - 1) / 6};
    for (int c = 0; c < s_; ++c) {
      double sum = 0.0;
      for (int k = 0; k < 4; ++k)
        sum += w[k] * coarser.z_[((j - 1 + k + m) % m) * s_ + c];
      z_[i * s_ + c] = sum;
    }
  }
}

void PeriodicLanes::interpolate_from(const PeriodicLanes& coarser) {
  rows_hold_sensitivities_ = false;
  const int m = coarser.n_;
  const Lanes& rate = *as_lanes(coarser.rate_.data());
  const Lanes* u = as_lanes(coarser.z_.data());
  Lanes* v = as_lanes(v_.data());
  Lanes* a = as_lanes(a_.data());
  difference_lanes(m, coarser.stencil_, rate, u, v, a);
  if (reversals_) {
    reversals_->inherit(*coarser.reversals_);
    coarser.reversals_->add_jumps(v, a);
  }
  refine_lanes({m, 1.0 / rate, u, v, a}, n_, as_lanes(z_.data()));
}

}  // namespace shaker::estimator
