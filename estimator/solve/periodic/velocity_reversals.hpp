/// \file
/// Correction of the finite differences for velocity reversals, where |v| v has a kink.
///
/// At a zero t* of the velocity the second derivative of the force over v jumps by kappa
/// (Effect::velocity_kink). The fourth derivative of the state u therefore jumps, and the third
/// derivative of its sensitivities s = dz/dtheta_k. Let m be the inertia, d the smooth part of the
/// damping, a and j the acceleration and the jerk, kappa_k = dkappa/dtheta_k, all at t*. A tilde
/// (x~) marks the mean of both sides. Then
///
///   [u'''' ] = -kappa a|a| / m
///   [u^(5)]  = -(3 kappa |a| j + d [u'''']) / m
///   [s''' ]  = -kappa |a| s' / m
///   [s'''' ] = -(kappa (sgn(a) j s' + 2 |a| s'') + kappa_k a|a| + d [s''']) / m
///   [s^(5)]  = -(kappa (sgn(a) u''''~ s' + 3 sgn(a) j s'' + 3 |a| s'''~) + 3 kappa_k |a| j
///                + d [s''''] + g_u [s''']) / m
///
/// This follows by differentiating g = 0 and g_a s'' + g_v s' + g_u s + g_theta = 0. A difference
/// whose stencil contains t* uses the smooth continuation of its own side: the neighbours on the
/// other side are shifted by the Taylor terms of the jumps. Without the correction every fixed grid
/// is of third order in u and of second order in s, however high the order of its stencil is.
///
///            own side  |  other side
///      o-----o-----o---|-o- - -o- - -o      neighbours right of t*:
///                      t*                   minus sum [u^(m)] (t - t*)^m / m!
///
/// The jumps of s depend on s itself. They are computed from the sensitivities of the previous
/// Newton step, so they converge together with Newton's method. A finer grid starts with the jumps
/// from the last sensitivities of the coarser grid.
#pragma once

#include <array>
#include <vector>

#include "estimator/math/aligned.hpp"
#include "estimator/math/lanes.hpp"
#include "estimator/solve/periodic/scheme.hpp"

namespace shaker::estimator {

/// The correction for one solution of a model with one coordinate. One thread; no member function
/// allocates after construction. `rows` are right-hand sides or solutions: for each point the
/// Newton step, then the sensitivities, padded to whole Lanes, 64-byte aligned, `row` doubles
/// apart.
class ReversalCorrection {
 public:
  /// \param stencil the differences that are corrected
  /// \param points number n of points
  /// \param parameters number of parameters
  /// \param row distance of the rows, doubles
  ReversalCorrection(const Stencil& stencil, int points, int parameters, int row);

  /// Discards all zeros and jumps.
  void forget();
  /// Starts from the zeros and jumps of `other`, another grid with the same solution. With `rows`
  /// (solutions on that grid, may be null) the jumps are first updated from its sensitivities.
  /// \param other the correction on the other grid
  /// \param rows solutions on that grid, or nullptr
  /// \param kappa_theta as in learn_sensitivities()
  void inherit(const ReversalCorrection& other, const double* rows, const double* kappa_theta);

  /// Finds the zeros of the velocity and corrects velocity and acceleration. `rate` is frequency
  /// times points, 1/s. `v` has n values and room for one more.
  /// \param kappa the jump at a reversal, 1 over the length unit
  /// \param rate frequency times points, 1/s
  /// \param v n velocities and room for one more
  /// \param a n accelerations
  void correct_state(double kappa, double rate, double* v, double* a);
  /// Adds the corrections of the zeros that were found last to velocity and acceleration.
  /// \param v n velocities
  /// \param a n accelerations
  void add_jumps(double* v, double* a) const;
  /// \return true if the velocity has a zero
  bool any() const { return count_ > 0; }
  /// Takes inertia, smooth damping and stiffness at the zeros from the evaluated model.
  /// \param g_u stiffness at n points
  /// \param g_v damping at n points
  /// \param g_a inertia at n points
  /// \param v n velocities
  void learn_slopes(const double* g_u, const double* g_v, const double* g_a, const double* v);
  /// Updates the jumps from the sensitivities in `rows`. Call it before new right-hand sides
  /// overwrite them. `kappa_theta`: dkappa/dtheta_k at [1 + k], 64-byte aligned, padded to a
  /// multiple of 8.
  /// \param rows solutions of the last step
  /// \param kappa_theta derivatives of kappa
  void learn_sensitivities(const double* rows, const double* kappa_theta);
  /// Corrects the right-hand sides of the sensitivities for the jumps.
  /// \param g_v damping at n points
  /// \param g_a inertia at n points
  /// \param rows right-hand sides to correct
  void correct_right_hand_sides(const double* g_v, const double* g_a, double* rows) const;

 private:
  static constexpr int kMost = 32;  // zeros over the ring; further ones are not corrected
  static constexpr int kOrders = 3;

  struct Zero {
    bool known = false;  // found by the previous step too, with this base
    int base = 0;        // last point before the zero
    double fraction = 0.0, acceleration = 0.0, jerk = 0.0, snap = 0.0;  // snap: mean of both sides
    double jump4 = 0.0, jump5 = 0.0;                                    // of the state
    double inertia = 1.0, damping = 0.0, stiffness = 0.0;
    // What unit jumps add to first and second differences at points base - reach + 1 and after.
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
    return const_cast<ReversalCorrection*>(this)->jumps(zero, order);
  }
  // Recomputes `jumps` (laid out as jumps_) from rows that were solved with their old values.
  void learn(const double* rows, const double* kappa_theta, double* jumps) const;

  Stencil stencil_;
  int n_, p_, row_;
  int stride_;  // of jumps_: columns, rounded up to whole Lanes
  double rate_ = 1.0, kappa_ = 0.0;
  int count_ = 0;  // zeros found by the last correct_state()
  int used_ = 0;   // entries of zeros_ in use
  int known_ = 0;  // zeros with jumps of the sensitivities
  std::array<Zero, kMost> zeros_;
  AlignedVector jumps_;                    // of the sensitivities: [zero][order - 3][column]
  AlignedVector offset_, first_, second_;  // of the neighbours across a zero: prepare_weights
};

}  // namespace shaker::estimator
