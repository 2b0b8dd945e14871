#include "estimator/solve/periodic/internal/lane_reversal_parts.hpp"

namespace shaker::estimator::lane_reversals {
namespace {

struct Slopes {  // velocity and acceleration at both neighbours of a zero
  Lanes v0, v1, a0, a1;
};

// As in velocity_reversals.cpp, which gives the reason.
constexpr double kSteepest = 2.0, kSharpest = 4.0;

SHAKER_INLINE Lanes held_within(const Lanes& x, const Lanes& most) {
  const Lanes end = chosen(x < 0.0, -most, most);
  return chosen(magnitude(x) <= most, x, end);
}

SHAKER_INLINE void set_jumps(const Lanes& kappa, const LaneMask& where, LaneZero& zero) {
  const Lanes size = magnitude(zero.acceleration);
  const Lanes over = -1.0 / zero.inertia;
  const Lanes jump4 = over * kappa * zero.acceleration * size;
  const Lanes jump5 = over * (3.0 * kappa * size * zero.jerk + zero.damping * jump4);
  keep(where, jump4, zero.jump4);
  keep(where, jump5, zero.jump5);
}

// Makes two Newton steps for the root of the Hermite cubic. Sets its derivatives there and the
// jumps.
SHAKER_INLINE void find_root(const Slopes& at, const Lanes& start, const Lanes& rate,
                             const Lanes& kappa, const LaneMask& where, LaneZero& zero) {
  const Lanes h = 1.0 / rate;
  const Lanes m0 = at.a0 * h;
  const Lanes m1 = at.a1 * h;
  const Lanes c2 = 3.0 * (at.v1 - at.v0) - 2.0 * m0 - m1;
  const Lanes c3 = m0 + m1 - 2.0 * (at.v1 - at.v0);
  Lanes t = start;
  for (int it = 0; it < 2; ++it) {
    const Lanes slope = m0 + t * (2.0 * c2 + 3.0 * t * c3);
    Lanes next = t - (at.v0 + t * (m0 + t * (c2 + t * c3))) / slope;
    next = chosen(next < 0.0, Lanes{}, next);
    next = chosen(next > 1.0, 1.0, next);
    t = chosen(slope == 0.0, t, next);
  }
  const Lanes acceleration = rate * (m0 + t * (2.0 * c2 + 3.0 * t * c3));
  const Lanes jerk = rate * rate * (2.0 * c2 + 6.0 * t * c3);
  keep(where, t, zero.fraction);
  keep(where, acceleration, zero.acceleration);
  keep(where, jerk, zero.jerk);
  set_jumps(kappa, where, zero);
  keep(where, 6.0 * rate * rate * rate * c3 + 0.5 * zero.jump4, zero.snap);
}

// Computes what unit jumps add to the differences. Each neighbour's Taylor terms serve for both.
SHAKER_INLINE void weigh(const std::array<ReversalPartners, kRows>& partners, int rows,
                         const Lanes& rate, const LaneMask& where, LaneZero& zero) {
  const Lanes h = 1.0 / rate;
  const Lanes square = rate * rate;
  for (int r = 0; r < rows; ++r) {
    const ReversalPartners& row = partners[static_cast<std::size_t>(r)];
    Lanes sum1[kOrders] = {};
    Lanes sum2[kOrders] = {};
    for (int k = 0; k < row.count; ++k) {
      const Lanes d = (row.offset[k] - zero.fraction) * h;
      Lanes term = d * d * d * (1.0 / 6.0);
      for (int m = 0; m < kOrders; ++m) {
        sum1[m] += row.first[k] * term;
        sum2[m] += row.second[k] * term;
        term *= d * (1.0 / (m + 4.0));
      }
    }
    for (int m = 0; m < kOrders; ++m) {
      keep(where, rate * sum1[m], zero.first[m][r]);
      keep(where, square * sum2[m], zero.second[m][r]);
    }
  }
}

}  // namespace

SHAKER_SIMD_CLONES void locate(const Located& in, LaneZero& zero) {
  const int reach = in.ring.reach;
  const LaneMask where = in.moving & zero.here;
  Slopes at;
  gather(in.ring, zero, 0, in.v, at.v0);
  gather(in.ring, zero, 0, in.a, at.a0);
  gather(in.ring, zero, 1, in.v, at.v1);
  gather(in.ring, zero, 1, in.a, at.a1);
  const Lanes before = magnitude(at.a0), after = magnitude(at.a1);
  const Lanes most = chosen(before > after, before, after);
  const LaneMask fresh = where & ~zero.known;
  if (bits_of(fresh) != 0) {
    find_root(at, at.v0 / (at.v0 - at.v1), in.rate, in.kappa, fresh, zero);
    weigh(*in.partners, 2 * reach, in.rate, fresh, zero);
  }
  const Lanes y = (1.0 - zero.fraction) / in.rate;
  const int row = reach - 1;
  at.v0 += zero.jump4 * zero.first[1][row] + zero.jump5 * zero.first[2][row];
  at.a0 += zero.jump4 * zero.second[1][row] + zero.jump5 * zero.second[2][row];
  at.v1 += zero.jump4 * zero.first[1][row + 1] + zero.jump5 * zero.first[2][row + 1];
  at.a1 += zero.jump4 * zero.second[1][row + 1] + zero.jump5 * zero.second[2][row + 1];
  at.v1 -= y * y * y * (zero.jump4 * (1.0 / 6.0) + y * zero.jump5 * (1.0 / 24.0));
  at.a1 -= y * y * (zero.jump4 * 0.5 + y * zero.jump5 * (1.0 / 6.0));
  find_root(at, zero.fraction, in.rate, in.kappa, where, zero);
  keep(where, held_within(zero.acceleration, kSteepest * most), zero.acceleration);
  keep(where, held_within(zero.jerk, kSharpest * most * in.rate), zero.jerk);
  set_jumps(in.kappa, where, zero);
  weigh(*in.partners, 2 * reach, in.rate, where, zero);
  zero.known |= where;
}

SHAKER_SIMD_CLONES void put_jumps(const Located& in, const LaneZero& zero) {
  const LaneMask where = in.moving & zero.here;
  const Lanes &jump4 = zero.jump4, &jump5 = zero.jump5;
  for (int r = 0; r < 2 * in.ring.reach; ++r) {
    const int offset = r - in.ring.reach + 1;
    const Lanes speed = jump4 * zero.first[1][r] + jump5 * zero.first[2][r];
    const Lanes acceleration = jump4 * zero.second[1][r] + jump5 * zero.second[2][r];
    // A lane without this zero may hold values of an earlier solution that are not finite. They are
    // masked, because multiplication by 0 would not remove them.
    scatter_add(in.ring, zero, offset, chosen(where, speed, Lanes{}), in.v);
    scatter_add(in.ring, zero, offset, chosen(where, acceleration, Lanes{}), in.a);
  }
}

namespace {

// Mask of the lanes whose velocity changes its sign between points i and i + 1.
SHAKER_INLINE unsigned changes(int n, int i, const Lanes* v) {
  const LaneMask before = v[i] < 0.0;
  const LaneMask after = v[i + 1 < n ? i + 1 : 0] < 0.0;
  return bits_of(before ^ after);
}

}  // namespace

// Eight points are tested together because changes are rare.
SHAKER_SIMD_CLONES int next_change(int n, int from, const Lanes* v, unsigned& lanes) {
  for (int i = from; i < n;) {
    const int end = i + 8 < n ? i + 8 : i;
    LaneMask sign = v[i] < 0.0;
    LaneMask any{};
    for (int j = i + 1; j <= end; ++j) {
      const LaneMask next = v[j] < 0.0;
      any |= sign ^ next;
      sign = next;
    }
    if (end > i && bits_of(any) == 0) {
      i = end;
      continue;
    }
    for (const int last = end > i ? end : n; i < last; ++i) {
      lanes = changes(n, i, v);
      if (lanes != 0) return i;
    }
  }
  return n;
}

}  // namespace shaker::estimator::lane_reversals
