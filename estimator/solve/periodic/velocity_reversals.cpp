#include "estimator/solve/periodic/velocity_reversals.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "estimator/math/lanes.hpp"

namespace shaker::estimator {
namespace {

// Limits of acceleration and jerk at a zero, relative to the largest acceleration at its
// neighbours (jerk: times the rate).
constexpr double kSteepest = 2.0, kSharpest = 4.0;

// Limits |x| to `most`. The jumps depend on the acceleration of the previous step, which contains
// the previous jumps. Where kappa |a| h^2 is not small (a trial step into the gas spring's wall),
// they would grow quadratically from step to step until they overflow.
double held_within(double x, double most) {
  return std::fabs(x) <= most ? x : std::copysign(most, x);
}

SHAKER_INLINE void negative(const double* v, LaneMask& out) {
  Lanes values;
  __builtin_memcpy(&values, v, sizeof values);  // v need not be aligned
  out = values < 0.0;
}

// Returns the first point, starting with `from`, after which the velocity changes its sign; n when
// there is none. Eight points are tested together because changes are rare.
SHAKER_SIMD_CLONES int next_change(int n, int from, const double* v) {
  int i = from;
  for (; i + kLanes <= n; i += kLanes) {
    LaneMask before, after;
    negative(v + i, before);
    negative(v + i + 1, after);
    const unsigned changes = bits_of(before ^ after);
    if (changes != 0) return i + std::countr_zero(changes);
  }
  while (i < n && (v[i] < 0.0) == (v[i + 1] < 0.0))
    ++i;
  return i;
}

template <class Zero>
void set_jumps(Zero& zero, double kappa) {
  const double size = std::fabs(zero.acceleration);
  const double over = -1.0 / zero.inertia;
  zero.jump4 = over * kappa * zero.acceleration * size;
  zero.jump5 = over * (3.0 * kappa * size * zero.jerk + zero.damping * zero.jump4);
}

}  // namespace

ReversalCorrection::ReversalCorrection(const Stencil& stencil, int points, int parameters, int row)
    : stencil_(stencil),
      n_(points),
      p_(parameters),
      row_(row),
      stride_((1 + parameters + kLanes - 1) / kLanes * kLanes),
      jumps_(static_cast<std::size_t>(kMost * kOrders) * static_cast<std::size_t>(stride_)) {
  prepare_weights();
}

void ReversalCorrection::forget() {
  for (int c = 0; c < used_; ++c)
    zeros_[static_cast<std::size_t>(c)] = Zero{};
  known_ = used_ = count_ = 0;
}

void ReversalCorrection::inherit(const ReversalCorrection& other, const double* rows,
                                 const double* kappa_theta) {
  forget();
  const int learnt = rows != nullptr ? other.count_ : other.known_;
  if (other.known_ == learnt)
    std::copy_n(other.jumps_.begin(), learnt * kOrders * stride_, jumps_.begin());
  else
    std::fill(jumps_.begin(), jumps_.end(), 0.0);
  if (rows != nullptr) other.learn(rows, kappa_theta, jumps_.data());
  known_ = used_ = learnt;
  for (int c = 0; c < known_; ++c) {
    Zero& zero = zeros_[static_cast<std::size_t>(c)];
    const Zero& old = other.zeros_[static_cast<std::size_t>(c)];
    zero.inertia = old.inertia;
    zero.damping = old.damping;
    zero.stiffness = old.stiffness;
  }
}

void ReversalCorrection::correct_state(double kappa, double rate, double* v, double* a) {
  kappa_ = kappa;
  rate_ = rate;
  count_ = 0;
  if (kappa == 0.0) return;
  v[n_] = v[0];
  for (int i = next_change(n_, 0, v); i < n_ && count_ < kMost; i = next_change(n_, i + 1, v)) {
    Zero& zero = zeros_[static_cast<std::size_t>(count_++)];
    // Values that an earlier step made not finite are not used as a start.
    zero.known = zero.known && zero.base == i && std::isfinite(zero.fraction + zero.jump5);
    if (!zero.known && !std::isfinite(zero.damping + zero.inertia)) zero = Zero{};
    zero.base = i;
    locate(zero, v, a);
    zero.known = true;
  }
  used_ = std::max(used_, count_);
  add_jumps(v, a);
}

void ReversalCorrection::add_jumps(double* v, double* a) const {
  const int reach = stencil_.reach;
  for (int c = 0; c < count_; ++c) {
    const Zero& zero = zeros_[static_cast<std::size_t>(c)];
    for (int r = 0; r < 2 * reach; ++r) {
      const int i = wrapped(zero.base - reach + 1 + r);
      v[i] += zero.jump4 * zero.first[1][r] + zero.jump5 * zero.first[2][r];
      a[i] += zero.jump4 * zero.second[1][r] + zero.jump5 * zero.second[2][r];
    }
  }
}

// Locates the zero as the root of the Hermite cubic through v and a at both neighbours. Both are
// first corrected with the jumps known so far (from the previous step, or a first guess). The right
// one is then shifted to the smooth continuation of the left side, so that the cubic has no kink.
void ReversalCorrection::locate(Zero& zero, const double* v, const double* a) const {
  const int reach = stencil_.reach;
  const double h = 1.0 / rate_;
  const double v0 = at(v, zero.base), a0 = at(a, zero.base);
  const double v1 = at(v, zero.base + 1), a1 = at(a, zero.base + 1);
  if (!zero.known) {
    zero.fraction = v0 / (v0 - v1);
    find_root(zero, v0, v1, a0, a1);
    weigh(zero);
  }
  const auto corrected = [&](double value, const double(&weights)[kOrders][kLanes], int side) {
    return value + zero.jump4 * weights[1][reach - 1 + side] +
           zero.jump5 * weights[2][reach - 1 + side];
  };
  const double y = (1.0 - zero.fraction) * h;
  find_root(zero, corrected(v0, zero.first, 0),
            corrected(v1, zero.first, 1) - y * y * y * (zero.jump4 / 6.0 + y * zero.jump5 / 24.0),
            corrected(a0, zero.second, 0),
            corrected(a1, zero.second, 1) - y * y * (zero.jump4 / 2.0 + y * zero.jump5 / 6.0));
  const double most = std::max(std::fabs(a0), std::fabs(a1));
  zero.acceleration = held_within(zero.acceleration, kSteepest * most);
  zero.jerk = held_within(zero.jerk, kSharpest * most * rate_);
  set_jumps(zero, kappa_);
  weigh(zero);
}

// Makes two Newton steps for the root of the Hermite cubic. Sets its derivatives there and the
// jumps.
void ReversalCorrection::find_root(Zero& zero, double v0, double v1, double a0, double a1) const {
  const double h = 1.0 / rate_;
  const double m0 = a0 * h;
  const double m1 = a1 * h;
  const double c2 = 3.0 * (v1 - v0) - 2.0 * m0 - m1;
  const double c3 = m0 + m1 - 2.0 * (v1 - v0);
  double t = zero.fraction;
  for (int it = 0; it < 2; ++it) {
    const double slope = m0 + t * (2.0 * c2 + 3.0 * t * c3);
    if (slope == 0.0) break;
    t = std::clamp(t - (v0 + t * (m0 + t * (c2 + t * c3))) / slope, 0.0, 1.0);
  }
  zero.fraction = t;
  zero.acceleration = rate_ * (m0 + t * (2.0 * c2 + 3.0 * t * c3));
  zero.jerk = rate_ * rate_ * (2.0 * c2 + 6.0 * t * c3);
  set_jumps(zero, kappa_);
  zero.snap = 6.0 * rate_ * rate_ * rate_ * c3 + 0.5 * zero.jump4;
}

namespace {

// Lane r is the row of point base - reach + 1 + r. `offset` holds its neighbours across the zero,
// counted from base; `first` and `second` hold their coefficients (0 where there is none).
SHAKER_SIMD_CLONES void weigh_rows(int partners, const double* offset, const double* first,
                                   const double* second, double fraction, double rate,
                                   double* weights1, double* weights2) {
  const double h = 1.0 / rate;
  double sum1[3][kLanes] = {}, sum2[3][kLanes] = {};
  for (int k = 0; k < partners; ++k) {
    for (int l = 0; l < kLanes; ++l) {
      const int at = kLanes * k + l;
      const double d = (offset[at] - fraction) * h;
      const double cube = d * d * d * (1.0 / 6.0);
      const double fourth = cube * d * (1.0 / 4.0), fifth = fourth * d * (1.0 / 5.0);
      sum1[0][l] += first[at] * cube;
      sum2[0][l] += second[at] * cube;
      sum1[1][l] += first[at] * fourth;
      sum2[1][l] += second[at] * fourth;
      sum1[2][l] += first[at] * fifth;
      sum2[2][l] += second[at] * fifth;
    }
  }
  for (int m = 0; m < 3; ++m) {
    for (int l = 0; l < kLanes; ++l) {
      weights1[kLanes * m + l] = rate * sum1[m][l];
      weights2[kLanes * m + l] = rate * rate * sum2[m][l];
    }
  }
}

}  // namespace

// Prepares each row's neighbours across the zero, one row in each lane, with signs.
void ReversalCorrection::prepare_weights() {
  const int reach = stencil_.reach;
  offset_.resize(static_cast<std::size_t>(reach * kLanes));
  first_.resize(offset_.size());
  second_.resize(offset_.size());
  for (int r = 0; r < 2 * reach; ++r) {
    const int own = r - reach + 1;  // counted from base
    const bool before = own <= 0;
    const int from = before ? 1 - own : -reach;
    const int to = before ? reach : -own;
    for (int k = from; k <= to; ++k) {
      const auto at = static_cast<std::size_t>((k - from) * kLanes + r);
      offset_[at] = own + k;
      first_[at] = (before ? -1.0 : 1.0) * stencil_.first[static_cast<std::size_t>(k + reach)];
      second_[at] = (before ? -1.0 : 1.0) * stencil_.second[static_cast<std::size_t>(k + reach)];
    }
  }
}

void ReversalCorrection::weigh(Zero& zero) const {
  weigh_rows(stencil_.reach, offset_.data(), first_.data(), second_.data(), zero.fraction, rate_,
             zero.first[0], zero.second[0]);
}

void ReversalCorrection::learn_slopes(const double* g_u, const double* g_v, const double* g_a,
                                      const double* v) {
  for (int c = 0; c < count_; ++c) {
    Zero& zero = zeros_[static_cast<std::size_t>(c)];
    const auto between = [&](double left, double right) {
      return left + zero.fraction * (right - left);
    };
    const int i = zero.base;
    zero.inertia = between(at(g_a, i), at(g_a, i + 1));
    zero.stiffness = between(at(g_u, i), at(g_u, i + 1));
    // The kinked part of d2g/dv2 is kappa / 2 on one side and -kappa / 2 on the other.
    zero.damping = between(at(g_v, i) - 0.5 * kappa_ * std::fabs(at(v, i)),
                           at(g_v, i + 1) - 0.5 * kappa_ * std::fabs(at(v, i + 1)));
  }
}

namespace {

struct SensitivityZero {
  int reach, parameters;
  double rate, fraction, acceleration, jerk, snap, inertia, damping, stiffness, kappa;
  const double *first, *second;       // stencil
  const double *weights1, *weights2;  // [3][8], of first and second difference
  std::array<const double*, 8> rows;  // of points base - reach to base + 1 + reach
  const double* kappa_theta;
  double* jumps;  // [3][stride]
  int stride;
};

// Computes s', s'' and s''' at the zero from the differences with the old jumps, then the new
// jumps.
SHAKER_SIMD_CLONES void learn_group(const SensitivityZero& z, int group) {
  const int reach = z.reach;
  Lanes* jump[3];
  for (int m = 0; m < 3; ++m)
    jump[m] = as_lanes(z.jumps + m * z.stride) + group;
  Lanes slope[2];
  Lanes curvature[2];
  for (int side = 0; side < 2; ++side) {
    Lanes s1{};
    Lanes s2{};
    for (int k = 0; k <= 2 * reach; ++k) {
      const Lanes s = as_lanes(z.rows[static_cast<std::size_t>(side + k)])[group];
      s1 += z.first[k] * s;
      s2 += z.second[k] * s;
    }
    s1 *= z.rate;
    s2 *= z.rate * z.rate;
    for (int m = 0; m < 3; ++m) {
      s1 += z.weights1[kLanes * m + reach - 1 + side] * *jump[m];
      s2 += z.weights2[kLanes * m + reach - 1 + side] * *jump[m];
    }
    slope[side] = s1;
    curvature[side] = s2;
  }
  const double h = 1.0 / z.rate;
  const double x = z.fraction * h;
  const double y = h - x;
  const Lanes third_before = (curvature[1] - curvature[0] - y * *jump[0]) * z.rate;
  const Lanes third = third_before + 0.5 * *jump[0];
  const Lanes second = curvature[0] + x * third_before;
  const Lanes first = slope[0] + x * (curvature[0] + 0.5 * x * third_before);

  const double size = std::fabs(z.acceleration);
  const double sign = z.acceleration < 0.0 ? -1.0 : 1.0;
  const double over = -1.0 / z.inertia;
  const Lanes own = as_lanes(z.kappa_theta)[group];
  Lanes jump3 = over * z.kappa * size * first;
  Lanes jump4 = over * (z.kappa * (sign * z.jerk * first + 2.0 * size * second) +
                        own * (size * z.acceleration) + z.damping * jump3);
  Lanes jump5 =
      over *
      (z.kappa * (sign * z.snap * first + 3.0 * sign * z.jerk * second + 3.0 * size * third) +
       own * (3.0 * size * z.jerk) + z.damping * jump4 + z.stiffness * jump3);
  const LaneMask mine = lanes_between(1 - kLanes * group, z.parameters - kLanes * group);
  // A value that is not finite would stay in the jumps for ever, because each jump depends on the
  // previous one.
  keep_finite(jump3);
  keep_finite(jump4);
  keep_finite(jump5);
  *jump[0] = chosen(mine, jump3, Lanes{});
  *jump[1] = chosen(mine, jump4, Lanes{});
  *jump[2] = chosen(mine, jump5, Lanes{});
}

}  // namespace

void ReversalCorrection::learn(const double* rows, const double* kappa_theta, double* jumps) const {
  for (int c = 0; c < count_; ++c) {
    const Zero& zero = zeros_[static_cast<std::size_t>(c)];
    SensitivityZero z{stencil_.reach,
                      p_,
                      rate_,
                      zero.fraction,
                      zero.acceleration,
                      zero.jerk,
                      zero.snap,
                      zero.inertia,
                      zero.damping,
                      zero.stiffness,
                      kappa_,
                      stencil_.first.data(),
                      stencil_.second.data(),
                      zero.first[0],
                      zero.second[0],
                      {},
                      kappa_theta,
                      jumps + c * kOrders * stride_,
                      stride_};
    for (int r = 0; r < 2 * stencil_.reach + 2; ++r)
      z.rows[static_cast<std::size_t>(r)] =
          rows + static_cast<std::ptrdiff_t>(row_) * wrapped(zero.base - stencil_.reach + r);
    for (int group = 0; group < stride_ / kLanes; ++group)
      learn_group(z, group);
  }
}

void ReversalCorrection::learn_sensitivities(const double* rows, const double* kappa_theta) {
  if (known_ != count_) std::fill(jumps_.begin(), jumps_.end(), 0.0);
  known_ = count_;
  learn(rows, kappa_theta, jumps_.data());
}

namespace {

struct JumpTerms {
  int rows, groups;
  const double *weights1, *weights2;  // [3][8], of first and second difference
  const double* jump;                 // [3][groups * 8]; 0 in the Newton step's lane
  std::array<double, 6> slope, inertia;
  std::array<double*, 6> row;
};

SHAKER_SIMD_CLONES void take_jumps(const JumpTerms& z) {
  for (int r = 0; r < z.rows; ++r) {
    const auto at = static_cast<std::size_t>(r);
    for (int m = 0; m < 3; ++m) {
      const double weight =
          z.slope[at] * z.weights1[kLanes * m + r] + z.inertia[at] * z.weights2[kLanes * m + r];
      for (int w = 0; w < z.groups; ++w)
        as_lanes(z.row[at])[w] -= weight * as_lanes(z.jump)[m * z.groups + w];
    }
  }
}

}  // namespace

void ReversalCorrection::correct_right_hand_sides(const double* g_v, const double* g_a,
                                                  double* rows) const {
  if (known_ != count_) return;
  for (int c = 0; c < count_; ++c) {
    const Zero& zero = zeros_[static_cast<std::size_t>(c)];
    JumpTerms z{2 * stencil_.reach,
                stride_ / kLanes,
                zero.first[0],
                zero.second[0],
                jumps(c, 0),
                {},
                {},
                {}};
    for (int r = 0; r < 2 * stencil_.reach; ++r) {
      const int i = wrapped(zero.base - stencil_.reach + 1 + r);
      const auto at = static_cast<std::size_t>(r);
      z.slope[at] = g_v[i];
      z.inertia[at] = g_a[i];
      z.row[at] = rows + static_cast<std::ptrdiff_t>(row_) * i;
    }
    take_jumps(z);
  }
}

}  // namespace shaker::estimator
