// A periodic solution with its sensitivities to an accuracy that is asked for.
//
// The grid is refined, 1, 2, 4, ... times as many points, each solution the start of the next,
// until the differences from grid to grid (grid_error.hpp) say that the finest is near enough:
// state and sensitivities both. Sixth order with the kinks corrected takes 120 points for the
// millionth for which a plain grid of fourth order takes 1600.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "estimator/periodic/periodic_system.hpp"

namespace shaker::estimator {

struct AccuracyOptions {
  GridOptions grid{Scheme::order6, 30, true};  // points: of the first grid
  int most_points = 7680;
};

struct AccuracyReport {
  SolveReport solve;
  int points = 0;
  // Estimated errors, against the largest value: of the state, and of the sensitivities over the
  // parameters (each against its own largest).
  double state_error = 0.0, sensitivity_error = 0.0;
  bool reached = false;
};

// Mutable workspace of one thread; grids are made when they are first needed.
class AccurateSolution {
 public:
  // `model` must outlive it.
  explicit AccurateSolution(const Model& model, AccuracyOptions options = {});

  // amplitude * cos(2 pi tau).
  void set_excitation(double frequency_hz, double amplitude);
  // `accuracy` is relative. A solution that cannot be found, or not that accurately on
  // `most_points`, is reported; the finest grid that has a solution is then the one to look at.
  AccuracyReport solve(std::span<const double> theta, double accuracy);
  // The finest grid of the last solution, its rows the sensitivities.
  const PeriodicSystem& system() const { return *levels_[finest_]; }

 private:
  struct Change {
    double state = 0.0, sensitivities = 0.0;
  };
  PeriodicSystem& level(std::size_t index);
  Change change(const PeriodicSystem& coarse, const PeriodicSystem& fine) const;

  const Model* model_;
  AccuracyOptions options_;
  double frequency_ = 1.0, amplitude_ = 0.0;
  std::vector<std::unique_ptr<PeriodicSystem>> levels_;
  std::vector<char> excited_;  // levels that have this excitation
  std::size_t finest_ = 0;
  mutable std::vector<double> largest_, difference_;
};

}  // namespace shaker::estimator
