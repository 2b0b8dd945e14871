#include "estimator/solve/periodic/internal/lane_reversal_parts.hpp"

namespace shaker::estimator::lane_reversals {
namespace {

struct Slopes2 {
  Lanes left, right;
};

// A sensitivity at a point of the window, whose row is another one in each lane.
SHAKER_INLINE Lanes sensitivity_at(const Lanes* rows, const int* point, bool together, int k) {
  if (together) return rows[point[0] + 1 + k];
  Lanes s;
  for (int l = 0; l < kLanes; ++l)
    s[l] = rows[point[l] + 1 + k][l];
  return s;
}

}  // namespace

SHAKER_SIMD_CLONES void take_slopes(const Ring& ring, const LaneMask& moving, const Lanes& kappa,
                                    const Lanes* g_u, const Lanes* g_v, const Lanes* g_a,
                                    const Lanes* v, LaneZero& zero) {
  const LaneMask where = moving & zero.here;
  Slopes2 at;
  Slopes2 speed;
  gather(ring, zero, 0, g_a, at.left);
  gather(ring, zero, 1, g_a, at.right);
  keep(where, at.left + zero.fraction * (at.right - at.left), zero.inertia);
  gather(ring, zero, 0, g_u, at.left);
  gather(ring, zero, 1, g_u, at.right);
  keep(where, at.left + zero.fraction * (at.right - at.left), zero.stiffness);
  gather(ring, zero, 0, g_v, at.left);
  gather(ring, zero, 1, g_v, at.right);
  gather(ring, zero, 0, v, speed.left);
  gather(ring, zero, 1, v, speed.right);
  // The kinked part of d2g/dv2 is kappa / 2 on one side and -kappa / 2 on the other.
  at.left -= 0.5 * kappa * magnitude(speed.left);
  at.right -= 0.5 * kappa * magnitude(speed.right);
  keep(where, at.left + zero.fraction * (at.right - at.left), zero.damping);
}

// Computes s', s'' and s''' at the zero from the differences with the old jumps, then the new
// jumps.
SHAKER_SIMD_CLONES void learn(const Learned& in, const LaneZero& zero) {
  const int reach = in.ring.reach;
  const LaneMask where = in.moving & zero.here;
  const Lanes h = 1.0 / in.rate;
  const Lanes x = zero.fraction * h;
  const Lanes y = h - x;
  const Lanes size = magnitude(zero.acceleration);
  const Lanes sign = chosen(zero.acceleration < 0.0, -1.0, 1.0);
  const Lanes over = -1.0 / zero.inertia;
  int point[8][kLanes];  // of the window, as an index of rows
  for (int w = 0; w < 2 * reach + 2; ++w) {
    for (int l = 0; l < kLanes; ++l)
      point[w][l] =
          in.columns * in.ring.wrapped(zero.base[static_cast<std::size_t>(l)] - reach + w);
  }
  for (int k = 0; k < in.sensitivities; ++k) {
    Lanes* jump[kOrders];
    for (int m = 0; m < kOrders; ++m)
      jump[m] = in.jumps + m * in.sensitivities + k;
    Lanes slope[2] = {};
    Lanes curvature[2] = {};
    for (int w = 0; w < 2 * reach + 2; ++w) {
      const Lanes s = sensitivity_at(in.rows, point[w], zero.together, k);
      for (int side = 0; side < 2; ++side) {
        if (w - side < 0 || w - side > 2 * reach) continue;
        slope[side] += in.stencil->first[static_cast<std::size_t>(w - side)] * s;
        curvature[side] += in.stencil->second[static_cast<std::size_t>(w - side)] * s;
      }
    }
    for (int side = 0; side < 2; ++side) {
      slope[side] *= in.rate;
      curvature[side] *= in.rate * in.rate;
      for (int m = 0; m < kOrders; ++m) {
        slope[side] += zero.first[m][reach - 1 + side] * *jump[m];
        curvature[side] += zero.second[m][reach - 1 + side] * *jump[m];
      }
    }
    const Lanes third_before = (curvature[1] - curvature[0] - y * *jump[0]) * in.rate;
    const Lanes third = third_before + 0.5 * *jump[0];
    const Lanes second = curvature[0] + x * third_before;
    const Lanes first = slope[0] + x * (curvature[0] + 0.5 * x * third_before);
    const Lanes own = in.kappa_theta[k];
    Lanes jump3 = over * in.kappa * size * first;
    Lanes jump4 = over * (in.kappa * (sign * zero.jerk * first + 2.0 * size * second) +
                          own * (size * zero.acceleration) + zero.damping * jump3);
    Lanes jump5 =
        over * (in.kappa * (sign * zero.snap * first + 3.0 * sign * zero.jerk * second +
                            3.0 * size * third) +
                own * (3.0 * size * zero.jerk) + zero.damping * jump4 + zero.stiffness * jump3);
    // A value that is not finite would stay in the jumps for ever, because each jump depends on the
    // previous one.
    keep_finite(jump3);
    keep_finite(jump4);
    keep_finite(jump5);
    keep(where, jump3, *jump[0]);
    keep(where, jump4, *jump[1]);
    keep(where, jump5, *jump[2]);
  }
}

SHAKER_SIMD_CLONES void correct(const Corrected& in, const LaneZero& zero) {
  const LaneMask where = in.where & zero.here;
  const int p = in.sensitivities;
  for (int r = 0; r < 2 * in.ring.reach; ++r) {
    const int offset = r - in.ring.reach + 1;
    Lanes slope;
    Lanes inertia;
    gather(in.ring, zero, offset, in.g_v, slope);
    gather(in.ring, zero, offset, in.g_a, inertia);
    Lanes weight[kOrders];
    for (int m = 0; m < kOrders; ++m)
      weight[m] = chosen(where, slope * zero.first[m][r] + inertia * zero.second[m][r], Lanes{});
    for (int k = 0; k < p; ++k) {
      const Lanes sum =
          weight[0] * in.jumps[k] + weight[1] * in.jumps[p + k] + weight[2] * in.jumps[2 * p + k];
      scatter_add(in.ring, zero, offset, sum, as_lanes(in.left[k]));
    }
  }
}

}  // namespace shaker::estimator::lane_reversals
