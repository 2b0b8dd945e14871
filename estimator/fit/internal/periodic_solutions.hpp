// The periodic solutions of all runs: on the fine grid, on a coarse one for the first steps, and in
// batches. Private to the sources of the estimator.
#pragma once

#include <string>
#include <vector>

#include "estimator/fit/internal/run_pack.hpp"

namespace shaker::estimator {

// `approach`: on the coarse grid, which is there if `coarse` is not empty.
struct PeriodicSolutions {
  explicit PeriodicSolutions(FitData& data);

  FitData& data;
  std::vector<PeriodicSystem> systems;
  std::vector<PeriodicSystem> coarse;  // or empty
  std::vector<RunPack> packs;          // all runs in batches; empty: one system after another

  void load(std::size_t run);  // after a change of its data
  std::vector<PeriodicSystem>& level(bool approach) { return approach ? coarse : systems; }

  // States between the single systems and the batches, and between the grids.
  void states_to_packs(bool approach);
  void packs_to_systems();
  void coarse_to_fine();

  // Linearises all solutions, and sums the products of rows and residuals; the residuals include
  // the Newton step. Returns false if a run cannot be linearised.
  bool linearise(bool approach, const std::vector<double>& theta, std::vector<double>& products);
  // The same sum from the present linearisation of the single systems.
  void sum_products(bool approach, bool with_newton, std::vector<double>& products);
  // Moves the solutions along a change of theta; returns the largest relative Newton step.
  double advance(bool approach, const std::vector<double>& change);
  // Keeps the states before a step, and goes back to `share` of the step.
  void save(bool approach);
  void shorten(bool approach, double share);

  // --- the branch of solutions that the rig was on
  SolveReport solve_run(std::size_t run, const std::vector<double>& theta, bool warm);
  // Returns a sentence for the first run without a solution; otherwise empty.
  std::string solve_all(const std::vector<double>& theta, bool warm);

 private:
  void make_packs();
  bool solve_near_data(std::size_t run, const std::vector<double>& theta, double from_rest);
  std::vector<std::vector<double>> saved_;  // one for each run
};

}  // namespace shaker::estimator
