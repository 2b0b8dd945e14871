#include "estimator/periodic/lane_kinks.hpp"

#include <algorithm>

namespace shaker::estimator {
namespace {

constexpr int kOrders = LaneZero::kOrders;
constexpr int kRows = LaneZero::kRows;

struct Ring {
  int n, reach;
  int wrapped(int i) const { return i < 0 ? i + n : i >= n ? i - n : i; }
};

SHAKER_INLINE LaneMask mask_of(unsigned lanes) {
  const LaneMask bit = {1, 2, 4, 8, 16, 32, 64, 128};
  return (bit & (LaneMask{} + static_cast<std::int64_t>(lanes))) != 0;
}

SHAKER_INLINE Lanes magnitude(const Lanes& x) {
  return x < 0.0 ? -x : x;
}

SHAKER_INLINE void keep(const LaneMask& where, const Lanes& value, Lanes& target) {
  target = where ? value : target;
}

// Values at point base + offset of each lane.
SHAKER_INLINE void gather(const Ring& ring, const LaneZero& zero, int offset, const Lanes* values,
                          Lanes& out) {
  if (zero.together) {
    out = values[ring.wrapped(zero.base[0] + offset)];
    return;
  }
  for (int l = 0; l < kLanes; ++l)
    out[l] = values[ring.wrapped(zero.base[static_cast<std::size_t>(l)] + offset)][l];
}

SHAKER_INLINE void scatter_add(const Ring& ring, const LaneZero& zero, int offset,
                               const Lanes& change, Lanes* values) {
  if (zero.together) {
    values[ring.wrapped(zero.base[0] + offset)] += change;
    return;
  }
  for (int l = 0; l < kLanes; ++l)
    values[ring.wrapped(zero.base[static_cast<std::size_t>(l)] + offset)][l] += change[l];
}

struct Slopes {  // of the velocity at both neighbours of a zero, smooth between them
  Lanes v0, v1, a0, a1;
};

// Two Newton steps for the root of the Hermite cubic; its derivatives there and the jumps.
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
    next = next < 0.0 ? Lanes{} : next;
    next = next > 1.0 ? Lanes{} + 1.0 : next;
    t = slope == 0.0 ? t : next;
  }
  const Lanes acceleration = rate * (m0 + t * (2.0 * c2 + 3.0 * t * c3));
  const Lanes jerk = rate * rate * (2.0 * c2 + 6.0 * t * c3);
  const Lanes size = magnitude(acceleration);
  const Lanes over = -1.0 / zero.inertia;
  Lanes jump4 = over * kappa * acceleration * size;
  Lanes jump5 = over * (3.0 * kappa * size * jerk + zero.damping * jump4);
  keep(where, t, zero.fraction);
  keep(where, acceleration, zero.acceleration);
  keep(where, jerk, zero.jerk);
  keep(where, jump4, zero.jump4);
  keep(where, jump5, zero.jump5);
  keep(where, 6.0 * rate * rate * rate * c3 + 0.5 * jump4, zero.snap);
}

// A shift of a zero only moves Taylor terms: each partner's are made once for both differences.
SHAKER_INLINE void weigh(const std::array<KinkPartners, kRows>& partners, int rows,
                         const Lanes& rate, const LaneMask& where, LaneZero& zero) {
  const Lanes h = 1.0 / rate;
  const Lanes square = rate * rate;
  for (int r = 0; r < rows; ++r) {
    const KinkPartners& row = partners[static_cast<std::size_t>(r)];
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

struct Located {
  Ring ring;
  const std::array<KinkPartners, kRows>* partners;
  Lanes rate, kappa;
  LaneMask moving;
  Lanes *v, *a;
};

// Where the cubic through v, a at both neighbours is zero: kinks.cpp says more.
SHAKER_SIMD_CLONES void locate(const Located& in, LaneZero& zero) {
  const int reach = in.ring.reach;
  const LaneMask where = in.moving & zero.here;
  Slopes at;
  gather(in.ring, zero, 0, in.v, at.v0);
  gather(in.ring, zero, 0, in.a, at.a0);
  gather(in.ring, zero, 1, in.v, at.v1);
  gather(in.ring, zero, 1, in.a, at.a1);
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
  weigh(*in.partners, 2 * reach, in.rate, where, zero);
  zero.known |= where;
}

SHAKER_SIMD_CLONES void put_jumps(const Located& in, const LaneZero& zero) {
  const LaneMask where = in.moving & zero.here;
  Lanes jump4 = where ? zero.jump4 : Lanes{};
  Lanes jump5 = where ? zero.jump5 : Lanes{};
  for (int r = 0; r < 2 * in.ring.reach; ++r) {
    const int offset = r - in.ring.reach + 1;
    scatter_add(in.ring, zero, offset, jump4 * zero.first[1][r] + jump5 * zero.first[2][r], in.v);
    scatter_add(in.ring, zero, offset, jump4 * zero.second[1][r] + jump5 * zero.second[2][r], in.a);
  }
}

// Lanes whose velocity changes its sign between points i and i + 1.
SHAKER_INLINE unsigned changes(int n, int i, const Lanes* v) {
  const LaneMask before = v[i] < 0.0;
  const LaneMask after = v[i + 1 < n ? i + 1 : 0] < 0.0;
  return bits_of(before ^ after);
}

// The first point, from `from` on, after which some velocity changes its sign; n when there is
// none. Changes are few: eight points are looked at together.
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

struct Slopes2 {
  Lanes left, right;
};

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
  // d2g/dv2 is kappa / 2 on one side, -kappa / 2 on the other.
  at.left -= 0.5 * kappa * magnitude(speed.left);
  at.right -= 0.5 * kappa * magnitude(speed.right);
  keep(where, at.left + zero.fraction * (at.right - at.left), zero.damping);
}

struct Learned {
  Ring ring;
  const Stencil* stencil;
  Lanes rate, kappa;
  LaneMask moving;
  const Lanes* rows;
  int columns, sensitivities;
  const Lanes* kappa_theta;
  Lanes* jumps;  // [order][sensitivity]
};

// s, s', s'' on both sides of the zero from the differences with the old jumps; then the new ones.
SHAKER_SIMD_CLONES void learn(const Learned& in, const LaneZero& zero) {
  const int reach = in.ring.reach;
  const LaneMask where = in.moving & zero.here;
  const Lanes h = 1.0 / in.rate;
  const Lanes x = zero.fraction * h;
  const Lanes y = h - x;
  const Lanes size = magnitude(zero.acceleration);
  const Lanes sign = zero.acceleration < 0.0 ? Lanes{} - 1.0 : Lanes{} + 1.0;
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
      Lanes s;
      if (zero.together) {
        s = in.rows[point[w][0] + 1 + k];
      } else {
        for (int l = 0; l < kLanes; ++l)
          s[l] = in.rows[point[w][l] + 1 + k][l];
      }
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
    // One failed step's overflow would stay in the jumps for ever, as each is made from the last.
    keep_finite(jump3);
    keep_finite(jump4);
    keep_finite(jump5);
    keep(where, jump3, *jump[0]);
    keep(where, jump4, *jump[1]);
    keep(where, jump5, *jump[2]);
  }
}

struct Corrected {
  Ring ring;
  LaneMask where;
  const Lanes *g_v, *g_a, *jumps;
  int sensitivities;
  double* const* left;
};

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
      weight[m] = where ? slope * zero.first[m][r] + inertia * zero.second[m][r] : Lanes{};
    for (int k = 0; k < p; ++k) {
      const Lanes sum =
          weight[0] * in.jumps[k] + weight[1] * in.jumps[p + k] + weight[2] * in.jumps[2 * p + k];
      scatter_add(in.ring, zero, offset, sum, as_lanes(in.left[k]));
    }
  }
}

}  // namespace

LaneKinks::LaneKinks(const Stencil& stencil, int points, int sensitivities, int columns)
    : stencil_(stencil),
      n_(points),
      sensitivities_(sensitivities),
      columns_(columns),
      zeros_(kMost),
      jumps_(kMost * static_cast<std::size_t>(kOrders * sensitivities * kLanes)) {
  const int reach = stencil_.reach;
  for (int r = 0; r < 2 * reach; ++r) {
    KinkPartners& row = partners_[static_cast<std::size_t>(r)];
    const int own = r - reach + 1;  // against base
    const bool before = own <= 0;
    for (int k = before ? 1 - own : -reach; k <= (before ? reach : -own); ++k, ++row.count) {
      const double side = before ? -1.0 : 1.0;
      row.offset[row.count] = own + k;
      row.first[row.count] = side * stencil_.first[static_cast<std::size_t>(k + reach)];
      row.second[row.count] = side * stencil_.second[static_cast<std::size_t>(k + reach)];
    }
  }
  used_ = static_cast<int>(kMost);
  forget();
}

void LaneKinks::forget() {
  for (int c = 0; c < used_; ++c) {
    LaneZero& zero = zeros_[static_cast<std::size_t>(c)];
    zero.here = zero.known = LaneMask{};
    zero.jump4 = zero.jump5 = zero.damping = zero.stiffness = Lanes{};
    zero.inertia = Lanes{} + 1.0;
  }
  count_.fill(0);
  known_.fill(0);
  used_ = 0;
}

void LaneKinks::inherit(const LaneKinks& coarser) {
  forget();
  known_ = coarser.known_;
  used_ = *std::max_element(known_.begin(), known_.end());
  std::copy_n(coarser.jumps_.begin(), used_ * kOrders * sensitivities_ * kLanes, jumps_.begin());
  for (int c = 0; c < used_; ++c) {
    LaneZero& zero = zeros_[static_cast<std::size_t>(c)];
    const LaneZero& old = coarser.zeros_[static_cast<std::size_t>(c)];
    for (std::size_t l = 0; l < kLanes; ++l) {
      if (known_[l] <= c) continue;
      zero.inertia[l] = old.inertia[l];
      zero.damping[l] = old.damping[l];
      zero.stiffness[l] = old.stiffness[l];
    }
  }
}

int LaneKinks::most_zeros() const {
  return *std::max_element(count_.begin(), count_.end());
}

void LaneKinks::find_zeros(unsigned moving, const Lanes* v) {
  for (std::size_t l = 0; l < kLanes; ++l) {
    if ((moving >> l & 1U) != 0) count_[l] = 0;
  }
  unsigned lanes = 0;
  for (int i = next_change(n_, 0, v, lanes); i < n_; i = next_change(n_, i + 1, v, lanes)) {
    for (std::size_t l = 0; l < kLanes; ++l) {
      if ((lanes & moving) >> l == 0) break;
      if (((lanes & moving) >> l & 1U) == 0 || count_[l] == static_cast<int>(kMost)) continue;
      LaneZero& zero = zeros_[static_cast<std::size_t>(count_[l]++)];
      if (zero.base[l] != i) zero.known[l] = 0;
      zero.base[l] = i;
    }
  }
  const int most = most_zeros();
  used_ = std::max(used_, most);
  for (int c = 0; c < most; ++c) {
    LaneZero& zero = zeros_[static_cast<std::size_t>(c)];
    zero.together = true;
    for (std::size_t l = 0; l < kLanes; ++l) {
      zero.here[l] = count_[l] > c ? -1 : 0;
      zero.together = zero.together && zero.base[l] == zero.base[0];
    }
  }
}

void LaneKinks::correct_state(const Lanes& kappa, const Lanes& rate, unsigned moving, Lanes* v,
                              Lanes* a) {
  kappa_ = kappa;
  rate_ = rate;
  unsigned kinked = 0;
  for (int l = 0; l < kLanes; ++l)
    kinked |= kappa[l] != 0.0 ? 1U << l : 0U;
  for (std::size_t l = 0; l < kLanes; ++l) {
    if ((moving & ~kinked) >> l & 1U) count_[l] = 0;
  }
  find_zeros(moving & kinked, v);
  const Located in{{n_, stencil_.reach}, &partners_, rate, kappa, mask_of(moving), v, a};
  const int most = most_zeros();
  for (int c = 0; c < most; ++c)
    locate(in, zeros_[static_cast<std::size_t>(c)]);
  for (int c = 0; c < most; ++c)
    put_jumps(in, zeros_[static_cast<std::size_t>(c)]);
}

void LaneKinks::learn_slopes(unsigned moving, const Lanes* g_u, const Lanes* g_v, const Lanes* g_a,
                             const Lanes* v) {
  const int most = most_zeros();
  for (int c = 0; c < most; ++c)
    take_slopes({n_, stencil_.reach}, mask_of(moving), kappa_, g_u, g_v, g_a, v,
                zeros_[static_cast<std::size_t>(c)]);
}

void LaneKinks::learn_sensitivities(unsigned moving, const Lanes* rows, const Lanes* kappa_theta) {
  for (std::size_t l = 0; l < kLanes; ++l) {
    if ((moving >> l & 1U) == 0 || known_[l] == count_[l]) continue;
    const int values = count_[l] * kOrders * sensitivities_;
    for (int i = 0; i < values; ++i)
      jumps_[static_cast<std::size_t>(i) * kLanes + l] = 0.0;
    known_[l] = count_[l];
  }
  const int most = most_zeros();
  for (int c = 0; c < most; ++c)
    learn({{n_, stencil_.reach},
           &stencil_,
           rate_,
           kappa_,
           mask_of(moving),
           rows,
           columns_,
           sensitivities_,
           kappa_theta,
           jumps(c, 0)},
          zeros_[static_cast<std::size_t>(c)]);
}

void LaneKinks::correct_left(unsigned moving, const Lanes* g_v, const Lanes* g_a,
                             double* const* left) const {
  unsigned lanes = 0;
  for (std::size_t l = 0; l < kLanes; ++l)
    lanes |= known_[l] == count_[l] ? 1U << l : 0U;
  const int most = most_zeros();
  for (int c = 0; c < most; ++c)
    correct({{n_, stencil_.reach},
             mask_of(lanes & moving),
             g_v,
             g_a,
             jumps(c, 0),
             sensitivities_,
             left},
            zeros_[static_cast<std::size_t>(c)]);
}

}  // namespace shaker::estimator
