// The correction of velocity_reversals.hpp for a batch of eight solutions, one in each SIMD lane.
// The equations are the same.
//
// One LaneZero holds the c-th zero of the velocity of every lane, wherever it lies in the period.
// Values around it are gathered and scattered lane by lane, or read directly if all lanes have that
// zero between the same two points. The other operations act on all lanes together. The values of
// a lane do not depend on its neighbours. Those of a lane that is not in `moving` do not change.
#pragma once

#include <array>
#include <vector>

#include "estimator/math/aligned.hpp"
#include "estimator/math/lanes.hpp"
#include "estimator/solve/periodic/scheme.hpp"

namespace shaker::estimator {

// The neighbours that one row's stencil has across a zero: offsets from the zero's base, and the
// stencil's coefficients with their signs. weigh() in lane_reversal_location.cpp uses them.
struct ReversalPartners {
  int count = 0;
  double offset[3] = {}, first[3] = {}, second[3] = {};
};

struct LaneZero {
  static constexpr int kRows = 6, kOrders = 3;
  std::array<int, kLanes> base{};  // last point before the zero
  bool together = false;           // all lanes have the same base
  LaneMask here{};                 // the lane has this zero
  LaneMask known{};                // found by the previous step too, with this base
  Lanes fraction{}, acceleration{}, jerk{}, snap{}, jump4{}, jump5{};
  Lanes inertia{}, damping{}, stiffness{};
  // What unit jumps of the third, fourth and fifth derivative add to first and second differences.
  Lanes first[kOrders][kRows] = {};
  Lanes second[kOrders][kRows] = {};
};

// Nothing allocates after construction. Arrays hold one Lanes for each point. Rows hold `columns`
// Lanes for each point: the Newton step, then the sensitivities. The functions are those of
// ReversalCorrection.
class LaneReversals {
 public:
  LaneReversals(const Stencil& stencil, int points, int sensitivities, int columns);

  void forget();
  void inherit(const LaneReversals& coarser);
  void correct_state(const Lanes& kappa, const Lanes& rate, unsigned moving, Lanes* v, Lanes* a);
  // Adds the corrections of the zeros that were found last to velocity and acceleration.
  void add_jumps(Lanes* v, Lanes* a) const;
  void learn_slopes(unsigned moving, const Lanes* g_u, const Lanes* g_v, const Lanes* g_a,
                    const Lanes* v);
  // `kappa_theta`: dkappa/dtheta_k, one Lanes for each sensitivity.
  void learn_sensitivities(unsigned moving, const Lanes* rows, const Lanes* kappa_theta);
  // Corrects `left`, minus the right-hand sides, for the jumps: one array for each sensitivity.
  void correct_left(unsigned moving, const Lanes* g_v, const Lanes* g_a, double* const* left) const;

 private:
  static constexpr std::size_t kMost = 32;  // zeros over the ring; further ones are not corrected
  int most_zeros() const;
  void find_zeros(unsigned moving, const Lanes* v);
  Lanes* jumps(int zero, int order) {
    return as_lanes(jumps_.data()) + (zero * LaneZero::kOrders + order) * sensitivities_;
  }
  const Lanes* jumps(int zero, int order) const {
    return as_lanes(jumps_.data()) + (zero * LaneZero::kOrders + order) * sensitivities_;
  }

  Stencil stencil_;
  int n_, sensitivities_, columns_;
  std::array<ReversalPartners, LaneZero::kRows> partners_{};
  Lanes rate_{}, kappa_{};
  std::array<int, kLanes> count_{};  // zeros of each lane
  std::array<int, kLanes> known_{};  // zeros of each lane with jumps of the sensitivities
  int used_ = 0;                     // entries of zeros_ in use
  std::vector<LaneZero> zeros_;
  AlignedVector jumps_;  // of the sensitivities: [zero][order - 3][sensitivity]
};

}  // namespace shaker::estimator
