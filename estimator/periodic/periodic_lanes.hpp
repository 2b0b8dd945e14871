// Eight periodic solutions of one model side by side, one a SIMD lane: PeriodicSystem's work for
// runs, records or frequencies that have as many points each, at a third of the time or less.
//
// Everything is vertical: value i of lane l stands at [8 i + l]. Lanes differ in excitation,
// frequency and parameters. A lane that turns out unsound (inadmissible, a small pivot) is reported
// and left to PeriodicSystem; it never disturbs its neighbours, whose numbers do not depend on it.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "estimator/math/aligned.hpp"
#include "estimator/math/lanes.hpp"
#include "estimator/model.hpp"
#include "estimator/periodic/lane_kinks.hpp"
#include "estimator/periodic/periodic_system.hpp"

namespace shaker::estimator {

inline constexpr unsigned kAllLanes = (1U << kLanes) - 1;

// Mutable workspace of one thread. Nothing allocates after construction.
class PeriodicLanes {
 public:
  // One coordinate and central differences are what it can do.
  static bool possible(const Model& model, const GridOptions& options);
  // Without sensitivities a step costs half; `sum_products` and `give` are then not to be used.
  PeriodicLanes(const Model& model, const GridOptions& options, bool sensitivities = true);

  int points() const { return n_; }
  // The excitation as it stands on the system's grid, which has as many points.
  void set_excitation(int lane, const PeriodicSystem& system);
  void set_frequency(int lane, double frequency_hz);
  // Forgets what earlier solutions left behind.
  void begin();
  // A start from a grid of fewer points or as many. It takes over the jumps at the kinks as
  // `learn_jumps` left them.
  void interpolate_from(const PeriodicLanes& coarser);
  // Takes the sensitivities' jumps at the kinks from the last solve_step, in these lanes: before
  // their rows are overwritten without having moved.
  void learn_jumps(unsigned lanes);

  double* state() { return z_.data(); }
  double* theta() { return theta_.data(); }  // parameter k of lane l at [8 k + l]

  // As in PeriodicSystem, for all lanes at once; a bit for each lane that is sound. Lanes without a
  // bit in `moving` are computed too, but leave no trace: their results are of no use.
  unsigned linearise(unsigned moving = kAllLanes);
  unsigned solve_step(unsigned moving = kAllLanes);
  // Sums of products with the data at points 0, every, ...; datum j of lane l at [8 j + l].
  // `products` gets the lower triangle, (1 + p)(2 + p)/2 Lanes, of residual and sensitivities.
  void sum_products(const double* data, int count, int every, double* products) const;
  // z += Newton step + sensitivities * delta in the lanes that `moving` has a bit for; the largest
  // Newton step against the largest state of each goes to `newton_step`.
  void advance(const double* delta, double* newton_step, unsigned moving = kAllLanes);
  // Puts a lane's state, differences and sensitivities into a system with as many points.
  void give(int lane, PeriodicSystem& system) const;

 private:
  void correct_jumps(unsigned moving);
  std::span<double> theta_of(std::size_t lane);

  const Model* model_;
  Stencil stencil_;
  int n_, width_, columns_;  // width: Newton step and sensitivities; columns: width + reach
  AlignedVector z_, v_, a_, x_, g_, g_u_, g_v_, g_a_, g_theta_, rows_, upper_, theta_, rate_;
  std::vector<double*> left_;                          // g, then a column for each parameter
  std::unique_ptr<LaneKinks> kinks_;                   // null when there is none to correct
  AlignedVector kappa_theta_, own_kappa_, own_theta_;  // own: of the lane in hand
  bool rows_hold_sensitivities_ = false;
};

}  // namespace shaker::estimator
