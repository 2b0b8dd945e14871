// What |v| v does to a fixed grid, and how it is undone.
//
// At a zero t* of the velocity the second derivative of the force over v jumps by kappa
// (Effect::velocity_kink), so that the fourth derivative of the state jumps, and the third of its
// sensitivities s = dz/dtheta_k. With m the inertia, d the smooth part of the damping, a, j the
// acceleration and jerk, kappa_k = dkappa/dtheta_k, all at t*, and a bar over the mean of both
// sides,
//
//   [u'''' ] = -kappa a|a| / m
//   [u^(5)]  = -(3 kappa |a| j + d [u'''']) / m
//   [s''' ]  = -kappa |a| s' / m
//   [s'''' ] = -(kappa (sgn(a) j s' + 2 |a| s'') + kappa_k a|a| + d [s''']) / m
//   [s^(5)]  = -(kappa (sgn(a) u''''~ s' + 3 sgn(a) j s'' + 3 |a| s'''~) + 3 kappa_k |a| j
//                + d [s''''] + g_u [s''']) / m
//
// by differentiating g = 0 and g_a s'' + g_v s' + g_u s + g_theta = 0. A difference whose stencil
// straddles t* is taken on the smooth continuation of its own side: the neighbours on the other
// side are shifted by the Taylor terms of the jumps. Without it every fixed grid is of third order
// in u and of second in s, however high its own order.
//
//            own side  |  other side
//      o-----o-----o---|-o- - -o- - -o      neighbours right of t*:
//                      t*                   minus sum [u^(m)] (t - t*)^m / m!
//
// The jumps of s need s itself: they are taken from the sensitivities of the step before, and so
// settle along with Newton's method. A finer grid starts from the jumps by the coarser one's last
// sensitivities.
#pragma once

#include <array>
#include <vector>

#include "estimator/math/aligned.hpp"
#include "estimator/math/lanes.hpp"
#include "estimator/periodic/scheme.hpp"

namespace shaker::estimator {

// Belongs to one solution of one coordinate. Nothing allocates after construction. Rows of
// right-hand sides and solutions, the Newton step first, then the sensitivities, are whole Lanes,
// `row` doubles apart and aligned.
class KinkCorrection {
 public:
  KinkCorrection(const Stencil& stencil, int points, int parameters, int row);

  // Begins anew: nothing is known of sensitivities.
  void forget();
  // Begins from what another grid knows of the same solution; from the sensitivities that its
  // `rows` hold as well, unless null.
  void inherit(const KinkCorrection& other, const double* rows, const double* kappa_theta);

  // Finds the zeros of the velocity and corrects velocity and acceleration; `rate` = frequency n.
  // `v` has room for one value behind the last point's.
  void correct_state(double kappa, double rate, double* v, double* a);
  // What the zeros that were found last do to velocity and acceleration.
  void add_jumps(double* v, double* a) const;
  bool any() const { return count_ > 0; }
  // After the model has been evaluated: inertia, smooth damping and stiffness at the zeros.
  void learn_slopes(const double* g_u, const double* g_v, const double* g_a, const double* v);
  // From the sensitivities that `rows` hold, before the next right-hand sides overwrite them;
  // `kappa_theta`: dkappa/dtheta_k at [1 + k], 64-byte aligned, padded to a multiple of 8.
  void learn_sensitivities(const double* rows, const double* kappa_theta);
  // Adds what the jumps do to the right-hand sides of the sensitivities.
  void correct_right_hand_sides(const double* g_v, const double* g_a, double* rows) const;

 private:
  static constexpr int kMost = 32;  // zeros in a period; further ones stay uncorrected
  static constexpr int kOrders = 3;

  struct Zero {
    bool known = false;  // from the step before, with this base
    int base = 0;        // last point before it
    double fraction = 0.0, acceleration = 0.0, jerk = 0.0, snap = 0.0;  // snap: mean of both sides
    double jump4 = 0.0, jump5 = 0.0;                                    // of the state
    double inertia = 1.0, damping = 0.0, stiffness = 0.0;
    // What unit jumps add to first and second differences at points base - reach + 1 ...
    alignas(64) double first[kOrders][kLanes] = {};
    alignas(64) double second[kOrders][kLanes] = {};
  };
  int wrapped(int i) const { return i < 0 ? i + n_ : i >= n_ ? i - n_ : i; }
  double at(const double* values, int i) const { return values[wrapped(i)]; }
  void locate(Zero& zero, const double* v, const double* a) const;
  void find_root(Zero& zero, double v0, double v1, double a0, double a1) const;
  void prepare_weights();
  void weigh(Zero& zero) const;
  double* jumps(int zero, int order) {
    return &jumps_[static_cast<std::size_t>(zero * kOrders + order) *
                   static_cast<std::size_t>(stride_)];
  }
  const double* jumps(int zero, int order) const {
    return const_cast<KinkCorrection*>(this)->jumps(zero, order);
  }
  // The jumps, `jumps` being laid out as jumps_, anew from the rows that were solved with them.
  void learn(const double* rows, const double* kappa_theta, double* jumps) const;

  Stencil stencil_;
  int n_, p_, row_;
  int stride_;  // of jumps_: columns, rounded up to whole Lanes
  double rate_ = 1.0, kappa_ = 0.0;
  int count_ = 0;  // zeros found
  int used_ = 0;   // of which something is remembered
  int known_ = 0;  // zeros for which jumps_ hold something; 0: nothing
  std::array<Zero, kMost> zeros_;
  AlignedVector jumps_;                    // of the sensitivities: [zero][order - 3][column]
  AlignedVector offset_, first_, second_;  // of the neighbours across a zero: prepare_weights
};

}  // namespace shaker::estimator
