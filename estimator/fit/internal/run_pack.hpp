// A batch of up to eight runs with equal numbers of points, one a lane. Lanes without a run repeat
// the last run with weight zero. Private to the sources of the estimator.
#pragma once

#include <memory>
#include <vector>

#include "estimator/fit/internal/fit_data.hpp"
#include "estimator/math/aligned.hpp"
#include "estimator/solve/periodic/periodic_lanes.hpp"

namespace shaker::estimator {

struct RunPack {
  RunPack(const Model& model, const GridOptions& grid, int data_points, bool with_coarse);
  PeriodicLanes fine;
  std::unique_ptr<PeriodicLanes> coarse;
  std::vector<std::size_t> runs;
  int every = 1;
  AlignedVector data, weight, products, delta, newton_step, saved;

  PeriodicLanes& level(bool approach) { return approach ? *coarse : fine; }
  // Takes the data of its runs, and their excitation from their systems.
  void load(const FitData& from, const std::vector<PeriodicSystem>& systems,
            const std::vector<PeriodicSystem>& coarse_systems);
  // States of its runs, from single systems and back. `approach`: on the coarse grid.
  void take_states(bool approach, const std::vector<PeriodicSystem>& systems);
  void give_states(std::vector<PeriodicSystem>& systems) const;
  // Linearises at theta and adds the products of rows and residuals, (1 + p) x (1 + p). Returns
  // false if a run cannot be linearised.
  bool add_products(bool approach, const std::vector<double>& theta, std::vector<double>& sums);
  // Moves the states along a change of theta. Returns the largest relative Newton step.
  double advance(bool approach, const std::vector<double>& change);
};

}  // namespace shaker::estimator
