// A periodic solution with its sensitivities to a requested accuracy.
//
// The number of grid points is doubled until the differences between grids (grid_error.hpp) show
// that state and sensitivities are accurate enough. Each solution is the start of the next. For a
// relative accuracy of 1e-6, order 6 with corrected kinks takes 120 points; order 4 without the
// correction takes 1600.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator {

struct AccuracyOptions {
  GridOptions grid{Scheme::order6, 30, true};  // points: of the first grid
  int most_points = 7680;
};

struct AccuracyReport {
  SolveReport solve;
  int points = 0;
  // Estimated errors of the state and of the sensitivities, each relative to its largest value.
  double state_error = 0.0, sensitivity_error = 0.0;
  bool reached = false;
};

// Mutable workspace of one thread. A grid is allocated when it is first needed.
class AccurateSolution {
 public:
  // `model` must outlive it.
  explicit AccurateSolution(const Model& model, AccuracyOptions options = {});

  // Sets the excitation to amplitude * cos(2 pi tau), m/s^2.
  void set_excitation(double frequency_hz, double amplitude);
  // Solves from rest to the relative `accuracy`. The report says if no solution was found, or none
  // of this accuracy with `most_points`; system() is then the finest grid with a solution.
  AccuracyReport solve(std::span<const double> theta, double accuracy);
  // The finest grid of the last solve(); its rows hold the sensitivities.
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
  std::vector<char> excited_;  // nonzero: the level has the present excitation
  std::size_t finest_ = 0;
  mutable std::vector<double> largest_, difference_;
};

}  // namespace shaker::estimator
