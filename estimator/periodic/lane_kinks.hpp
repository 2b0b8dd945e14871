// kinks.hpp's correction for eight solutions side by side: the equations are those, one solution in
// each SIMD lane.
//
// The c-th zero of the velocity of every lane stands in one LaneZero, wherever it lies in the
// period; what is read or written around it is gathered and scattered lane by lane (or taken as it
// stands where all lanes have that zero between the same two points), everything between is
// vertical. A lane's numbers do not depend on its neighbours, and those of a lane that is not in
// `moving` stay as they are.
#pragma once

#include <array>
#include <vector>

#include "estimator/math/aligned.hpp"
#include "estimator/math/lanes.hpp"
#include "estimator/periodic/scheme.hpp"

namespace shaker::estimator {

// Neighbours of a stencil across a zero, row by row against its base: see LaneKinks::weigh.
struct KinkPartners {
  int count = 0;
  double offset[3] = {}, first[3] = {}, second[3] = {};
};

struct LaneZero {
  static constexpr int kRows = 6, kOrders = 3;
  std::array<int, kLanes> base{};  // last point before it
  bool together = false;           // one base for all lanes
  LaneMask here{};                 // the lane has this zero
  LaneMask known{};                // from the step before, with this base
  Lanes fraction{}, acceleration{}, jerk{}, snap{}, jump4{}, jump5{};
  Lanes inertia{}, damping{}, stiffness{};
  // What unit jumps of the third, fourth and fifth derivative add to first and second differences.
  Lanes first[kOrders][kRows] = {};
  Lanes second[kOrders][kRows] = {};
};

// Nothing allocates after construction. Arrays hold a Lanes a point; rows `columns` Lanes a point,
// the Newton step first, then the sensitivities.
class LaneKinks {
 public:
  LaneKinks(const Stencil& stencil, int points, int sensitivities, int columns);

  void forget();
  void inherit(const LaneKinks& coarser);
  void correct_state(const Lanes& kappa, const Lanes& rate, unsigned moving, Lanes* v, Lanes* a);
  // What the zeros that were found last do to velocity and acceleration.
  void add_jumps(Lanes* v, Lanes* a) const;
  void learn_slopes(unsigned moving, const Lanes* g_u, const Lanes* g_v, const Lanes* g_a,
                    const Lanes* v);
  // `kappa_theta`: a Lanes for each sensitivity.
  void learn_sensitivities(unsigned moving, const Lanes* rows, const Lanes* kappa_theta);
  // Adds what the jumps do to `left`, an array for each sensitivity: minus the right-hand sides.
  void correct_left(unsigned moving, const Lanes* g_v, const Lanes* g_a, double* const* left) const;

 private:
  static constexpr std::size_t kMost = 32;  // zeros in a period; further ones stay uncorrected
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
  std::array<KinkPartners, LaneZero::kRows> partners_{};
  Lanes rate_{}, kappa_{};
  std::array<int, kLanes> count_{};  // zeros of each lane
  std::array<int, kLanes> known_{};  // zeros for which jumps_ hold something
  int used_ = 0;                     // zeros of which something is remembered
  std::vector<LaneZero> zeros_;
  AlignedVector jumps_;  // of the sensitivities: [zero][order - 3][sensitivity]
};

}  // namespace shaker::estimator
