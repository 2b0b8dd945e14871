// The work of LaneReversals at one zero of the velocity, for all lanes: location and jumps of the
// state (lane_reversal_location.cpp), jumps of the sensitivities (lane_reversal_sensitivities.cpp).
// Internal to lane_reversals.cpp.
#pragma once

#include <array>

#include "estimator/solve/periodic/internal/lane_reversals.hpp"

namespace shaker::estimator::lane_reversals {

inline constexpr int kOrders = LaneZero::kOrders;
inline constexpr int kRows = LaneZero::kRows;

struct Ring {
  int n, reach;
  int wrapped(int i) const { return i < 0 ? i + n : i >= n ? i - n : i; }
};

SHAKER_INLINE void keep(const LaneMask& where, const Lanes& value, Lanes& target) {
  target = chosen(where, value, target);
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

// --- lane_reversal_location.cpp

struct Located {
  Ring ring;
  const std::array<ReversalPartners, kRows>* partners;
  Lanes rate, kappa;
  LaneMask moving;
  Lanes *v, *a;
};

// Locates the zero as the root of the cubic through v and a at both neighbours (see
// velocity_reversals.cpp), and computes its jumps.
void locate(const Located& in, LaneZero& zero);
// Adds the corrections for the zero's jumps to velocity and acceleration around it.
void put_jumps(const Located& in, const LaneZero& zero);
// Returns the first point, starting with `from`, after which some velocity changes its sign; n when
// there is none. `lanes` gets the mask of these lanes.
int next_change(int n, int from, const Lanes* v, unsigned& lanes);

// --- lane_reversal_sensitivities.cpp

// Takes inertia, stiffness and smooth damping at the zero.
void take_slopes(const Ring& ring, const LaneMask& moving, const Lanes& kappa, const Lanes* g_u,
                 const Lanes* g_v, const Lanes* g_a, const Lanes* v, LaneZero& zero);

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

// Recomputes the jumps of the sensitivities from rows that were solved with their old values.
void learn(const Learned& in, const LaneZero& zero);

struct Corrected {
  Ring ring;
  LaneMask where;
  const Lanes *g_v, *g_a, *jumps;
  int sensitivities;
  double* const* left;
};

// Corrects `left`, minus the right-hand sides, for the jumps.
void correct(const Corrected& in, const LaneZero& zero);

}  // namespace shaker::estimator::lane_reversals
