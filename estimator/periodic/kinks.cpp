#include "estimator/periodic/kinks.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/math/lanes.hpp"

namespace shaker::estimator {

KinkCorrection::KinkCorrection(const Stencil& stencil, int points, int parameters, int stride)
    : stencil_(stencil),
      n_(points),
      p_(parameters),
      stride_(stride),
      jumps_(static_cast<std::size_t>(kMost * kOrders) * static_cast<std::size_t>(stride)) {}

void KinkCorrection::forget() {
  known_ = 0;
  for (Zero& zero : zeros_)
    zero.inertia = 1.0, zero.damping = zero.stiffness = 0.0;
}

void KinkCorrection::inherit(const KinkCorrection& other) {
  known_ = other.known_;
  std::copy_n(other.jumps_.begin(), known_ * kOrders * stride_, jumps_.begin());
  for (int c = 0; c < known_; ++c) {
    Zero& zero = zeros_[static_cast<std::size_t>(c)];
    const Zero& old = other.zeros_[static_cast<std::size_t>(c)];
    zero.inertia = old.inertia;
    zero.damping = old.damping;
    zero.stiffness = old.stiffness;
  }
}

void KinkCorrection::correct_state(double kappa, double rate, double* v, double* a) {
  kappa_ = kappa;
  rate_ = rate;
  count_ = 0;
  if (kappa == 0.0) return;
  for (int i = 0; i < n_ && count_ < kMost; ++i) {
    if ((v[i] < 0.0) == (v[wrapped(i + 1)] < 0.0)) continue;
    Zero& zero = zeros_[static_cast<std::size_t>(count_++)];
    zero.base = i;
    locate(zero, v, a);
  }
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

// Where the cubic through v, a at both neighbours is zero: first as they are, then both corrected
// and the right one continued from the left, so that the cubic has no kink in it.
void KinkCorrection::locate(Zero& zero, const double* v, const double* a) const {
  const int reach = stencil_.reach;
  const double h = 1.0 / rate_;
  const double v0 = v[zero.base];
  const double a0 = a[zero.base];
  const double v1 = v[wrapped(zero.base + 1)];
  const double a1 = a[wrapped(zero.base + 1)];
  zero.fraction = v0 / (v0 - v1);
  find_root(zero, v0, v1, a0, a1);
  weigh(zero, reach - 1, reach + 1);
  const auto corrected = [&](double value, const double(&weights)[kOrders][6], int side) {
    return value + zero.jump4 * weights[1][reach - 1 + side] +
           zero.jump5 * weights[2][reach - 1 + side];
  };
  const double y = (1.0 - zero.fraction) * h;
  find_root(zero, corrected(v0, zero.first, 0),
            corrected(v1, zero.first, 1) - y * y * y * (zero.jump4 / 6.0 + y * zero.jump5 / 24.0),
            corrected(a0, zero.second, 0),
            corrected(a1, zero.second, 1) - y * y * (zero.jump4 / 2.0 + y * zero.jump5 / 6.0));
  weigh(zero, 0, 2 * reach);
}

// Two Newton steps for the root of the Hermite cubic; its derivatives there and the jumps.
void KinkCorrection::find_root(Zero& zero, double v0, double v1, double a0, double a1) const {
  const double m0 = a0 / rate_;
  const double c2 = 3.0 * (v1 - v0) - 2.0 * m0 - a1 / rate_;
  const double c3 = m0 + a1 / rate_ - 2.0 * (v1 - v0);
  double t = zero.fraction;
  double slope = m0;
  for (int it = 0; it < 2; ++it) {
    slope = m0 + t * (2.0 * c2 + 3.0 * t * c3);
    if (slope == 0.0) break;
    t = std::clamp(t - (v0 + t * (m0 + t * (c2 + t * c3))) / slope, 0.0, 1.0);
  }
  zero.fraction = t;
  zero.acceleration = rate_ * (m0 + t * (2.0 * c2 + 3.0 * t * c3));
  zero.jerk = rate_ * rate_ * (2.0 * c2 + 6.0 * t * c3);
  const double size = std::fabs(zero.acceleration);
  zero.jump4 = -kappa_ * zero.acceleration * size / zero.inertia;
  zero.jump5 = -(3.0 * kappa_ * size * zero.jerk + zero.damping * zero.jump4) / zero.inertia;
  zero.snap = 6.0 * rate_ * rate_ * rate_ * c3 + 0.5 * zero.jump4;
}

// Weights of rows `begin` to `end` of the 2 reach that straddle.
void KinkCorrection::weigh(Zero& zero, int begin, int end) const {
  const int reach = stencil_.reach;
  const double h = 1.0 / rate_;
  for (int r = begin; r < end; ++r) {
    const int own = r - reach + 1;  // against base
    const bool before = own <= 0;
    double first[kOrders] = {};
    double second[kOrders] = {};
    const int from = before ? 1 - own : -reach;
    const int to = before ? reach : -own;
    for (int k = from; k <= to; ++k) {
      const double d = (own + k - zero.fraction) * h;
      double term = (before ? -1.0 : 1.0) * d * d * d / 6.0;
      for (int m = 0; m < kOrders; ++m) {
        first[m] += stencil_.first[static_cast<std::size_t>(k + reach)] * term;
        second[m] += stencil_.second[static_cast<std::size_t>(k + reach)] * term;
        term *= d / (m + 4);
      }
    }
    for (int m = 0; m < kOrders; ++m) {
      zero.first[m][r] = rate_ * first[m];
      zero.second[m][r] = rate_ * rate_ * second[m];
    }
  }
}

void KinkCorrection::learn_slopes(const double* g_u, const double* g_v, const double* g_a,
                                  const double* v) {
  for (int c = 0; c < count_; ++c) {
    Zero& zero = zeros_[static_cast<std::size_t>(c)];
    const int i = zero.base;
    const int next = wrapped(i + 1);
    const auto between = [&](double left, double right) {
      return left + zero.fraction * (right - left);
    };
    zero.inertia = between(g_a[i], g_a[next]);
    zero.stiffness = between(g_u[i], g_u[next]);
    // d2g/dv2 is kappa / 2 on one side, -kappa / 2 on the other.
    zero.damping = between(g_v[i] - 0.5 * kappa_ * std::fabs(v[i]),
                           g_v[next] - 0.5 * kappa_ * std::fabs(v[next]));
  }
}

namespace {

struct SensitivityZero {
  int n, reach, base, first_lane, last_lane;
  double rate, fraction, acceleration, jerk, snap, inertia, damping, stiffness, kappa;
  const double *first, *second;       // stencil
  const double *weights1, *weights2;  // [3][6], of first and second difference
  const double* rows;
  const double* kappa_lanes;  // dkappa/dtheta_k in the lane of theta_k
  double* jumps;              // [3][stride]
  int stride;
};

// s, s', s'' on both sides of the zero from the differences with the old jumps; then the new ones.
SHAKER_SIMD_CLONES void learn(const SensitivityZero& z, int group) {
  const int reach = z.reach;
  Lanes* jump[3];
  for (int m = 0; m < 3; ++m)
    jump[m] = reinterpret_cast<Lanes*>(z.jumps + m * z.stride) + group;
  Lanes slope[2];
  Lanes curvature[2];
  for (int side = 0; side < 2; ++side) {
    const int own = z.base + side;
    Lanes s1{};
    Lanes s2{};
    for (int k = 0; k <= 2 * reach; ++k) {
      int i = own - reach + k;
      i = i < 0 ? i + z.n : i >= z.n ? i - z.n : i;
      const Lanes s = reinterpret_cast<const Lanes*>(
          z.rows + static_cast<std::size_t>(i) * static_cast<std::size_t>(z.stride))[group];
      s1 += z.first[k] * s;
      s2 += z.second[k] * s;
    }
    s1 *= z.rate;
    s2 *= z.rate * z.rate;
    for (int m = 0; m < 3; ++m) {
      s1 += z.weights1[6 * m + reach - 1 + side] * *jump[m];
      s2 += z.weights2[6 * m + reach - 1 + side] * *jump[m];
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
  const Lanes own = reinterpret_cast<const Lanes*>(z.kappa_lanes)[group];
  const Lanes jump3 = over * z.kappa * size * first;
  const Lanes jump4 = over * (z.kappa * (sign * z.jerk * first + 2.0 * size * second) +
                              own * (size * z.acceleration) + z.damping * jump3);
  const Lanes jump5 =
      over *
      (z.kappa * (sign * z.snap * first + 3.0 * sign * z.jerk * second + 3.0 * size * third) +
       own * (3.0 * size * z.jerk) + z.damping * jump4 + z.stiffness * jump3);
  const LaneMask lane = LaneMask{0, 1, 2, 3, 4, 5, 6, 7} + 8 * group;
  const LaneMask mine = (lane >= z.first_lane) & (lane <= z.last_lane);
  *jump[0] = mine ? jump3 : Lanes{};
  *jump[1] = mine ? jump4 : Lanes{};
  *jump[2] = mine ? jump5 : Lanes{};
}

SHAKER_SIMD_CLONES void subtract_jumps(int stride, double w3, double w4, double w5,
                                       const double* __restrict jumps, double* __restrict row) {
  for (int w = 0; w < stride; ++w)
    row[w] -= w3 * jumps[w] + w4 * jumps[stride + w] + w5 * jumps[2 * stride + w];
}

}  // namespace

void KinkCorrection::learn_sensitivities(const double* rows, const double* kappa_lanes) {
  if (known_ != count_) std::fill(jumps_.begin(), jumps_.end(), 0.0);
  known_ = count_;
  for (int c = 0; c < count_; ++c) {
    const Zero& zero = zeros_[static_cast<std::size_t>(c)];
    const SensitivityZero z{n_,
                            stencil_.reach,
                            zero.base,
                            1,
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
                            rows,
                            kappa_lanes,
                            jumps(c, 0),
                            stride_};
    for (int group = 0; group < stride_ / kLanes; ++group)
      learn(z, group);
  }
}

void KinkCorrection::correct_right_hand_sides(const double* g_v, const double* g_a,
                                              double* rows) const {
  if (known_ != count_) return;
  for (int c = 0; c < count_; ++c) {
    const Zero& zero = zeros_[static_cast<std::size_t>(c)];
    for (int r = 0; r < 2 * stencil_.reach; ++r) {
      const int i = wrapped(zero.base - stencil_.reach + 1 + r);
      const auto weight = [&](int m) {
        return g_v[i] * zero.first[m][r] + g_a[i] * zero.second[m][r];
      };
      subtract_jumps(stride_, weight(0), weight(1), weight(2), jumps(c, 0),
                     rows + static_cast<std::size_t>(i) * static_cast<std::size_t>(stride_));
    }
  }
}

}  // namespace shaker::estimator
