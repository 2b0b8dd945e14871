// A batch of eight periodic solutions of one model, one in each SIMD lane. It does the work of
// PeriodicSystem for runs, records or frequencies with equally many points, in at most a third of
// the time.
//
// Value i of lane l is at [8 i + l] in all arrays. Lanes differ in excitation, frequency and
// parameters. A lane that is unsound (inadmissible, a small pivot) is reported; the caller solves
// it with PeriodicSystem. The values of a lane do not depend on its neighbours.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "estimator/math/aligned.hpp"
#include "estimator/math/lanes.hpp"
#include "estimator/model/model.hpp"
#include "estimator/solve/periodic/internal/lane_reversals.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator {

inline constexpr unsigned kAllLanes = (1U << kLanes) - 1;

// Mutable workspace of one thread. Nothing allocates after construction.
class PeriodicLanes {
 public:
  // True when the batch supports the model and grid: Model::lanes_possible() (one coordinate) and a
  // difference scheme.
  static bool possible(const Model& model, const GridOptions& options);
  // Precondition: possible(model, options). `model` must outlive the object. Without sensitivities
  // a step costs half; `sum_products` and `give` must then not be called.
  PeriodicLanes(const Model& model, const GridOptions& options, bool sensitivities = true);

  int points() const { return n_; }
  // Copies excitation and frequency of a system with equally many points.
  void set_excitation(int lane, const PeriodicSystem& system);
  void set_frequency(int lane, double frequency_hz);
  // Discards what earlier solutions left in the workspace.
  void begin();
  // Interpolates the state from a grid with at most as many points. It also takes over the jumps at
  // the velocity reversals, as `learn_jumps` left them.
  void interpolate_from(const PeriodicLanes& coarser);
  // Updates the jumps of the sensitivities at the velocity reversals from the last solve_step, in
  // these lanes. Call it before their rows are overwritten.
  void learn_jumps(unsigned lanes);

  double* state() { return z_.data(); }
  double* theta() { return theta_.data(); }  // parameter k of lane l at [8 k + l]

  // As in PeriodicSystem, for all lanes at once. Both return a mask with a bit for each sound lane.
  // Lanes without a bit in `moving` are computed too, but their results must not be used.
  unsigned linearise(unsigned moving = kAllLanes);
  unsigned solve_step(unsigned moving = kAllLanes);
  // Sums of products with `count` data at points 0, every, ...; datum j of lane l is at [8 j + l].
  // `products` gets the lower triangle, (1 + p)(2 + p)/2 Lanes, of (residual, sensitivities).
  void sum_products(const double* data, int count, int every, double* products) const;
  // z += Newton step + sensitivities * delta in the lanes with a bit in `moving`; delta k of lane l
  // is at [8 k + l]. `newton_step` gets max |Newton step| / max |z| of each lane.
  void advance(const double* delta, double* newton_step, unsigned moving = kAllLanes);
  // Copies a lane's state, differences and sensitivities into a system with equally many points.
  void give(int lane, PeriodicSystem& system) const;

 private:
  void correct_jumps(unsigned moving);
  std::span<double> theta_of(std::size_t lane);

  const Model* model_;
  Stencil stencil_;
  int n_, width_, columns_;  // width: Newton step and sensitivities; columns: width + reach
  AlignedVector z_, v_, a_, x_, g_, g_u_, g_v_, g_a_, g_theta_, rows_, upper_, theta_, rate_;
  std::vector<double*> left_;                          // g, then a column for each parameter
  std::unique_ptr<LaneReversals> reversals_;           // null: no kinks to correct
  AlignedVector kappa_theta_, own_kappa_, own_theta_;  // own: scratch for one lane
  bool rows_hold_sensitivities_ = false;
};

}  // namespace shaker::estimator
