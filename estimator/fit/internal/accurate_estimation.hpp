// An estimate to a required accuracy: the grid is refined until theta no longer depends on it.
//
// The second grid has twice the points of the first. After that the observed differences of theta
// give the next number of points, at most four times the last. Each fit is the start of the next.
// The decrease of the differences from grid to grid gives the remaining discretisation error
// (solve/periodic/grid_error.hpp). That error is a bias, which no amount of data averages out.
#pragma once

#include <memory>
#include <vector>

#include "estimator/fit/estimation.hpp"

namespace shaker::estimator {

struct AccurateOptions {
  // grid.points: of the first grid, at least the data's own. `accuracy` sets the tolerance.
  EstimationOptions estimation{.grid = {Scheme::order6, 40, true}};
  double accuracy = 1e-9;  // of every free parameter, relative
  int most_points = 4000;  // upper limit for the points of the first run's grid
};

// Workspace for one model and one set of runs. One thread at a time may use it. It keeps the grids
// it has made, so that a further fit on the same grids allocates no more than Estimator does.
class AccurateEstimator {
 public:
  // Throws as Estimator does. `model` must outlive the object.
  AccurateEstimator(const Model& model, std::vector<RunData> runs, AccurateOptions options = {});

  // Fits from `start` (all parameters). Returns the fit on the finest grid that converged, or on
  // the first grid if none did.
  const Fit& fit(const std::vector<double>& start);

  // Estimated relative error of the last fit's theta. Infinite if fewer than three grids converged.
  double error() const { return error_; }
  bool reached() const { return error_ <= options_.accuracy; }
  // Points per excitation period of the first run's finest grid.
  int points() const { return ring() / runs_.front().periods; }
  // The estimator on the finest grid of the last fit.
  Estimator& finest() { return *levels_[at_].estimator; }
  const Estimator& finest() const { return *levels_[at_].estimator; }

 private:
  // Points of the first run's grid over all of its periods.
  int ring() const { return finest().solutions().front().points(); }
  struct Level {
    int multiple;  // of the first grid's points
    std::unique_ptr<Estimator> estimator;
  };
  std::size_t level(int multiple);
  int next_multiple(double change, double ratio) const;
  double change(const std::vector<double>& from, const std::vector<double>& to) const;

  const Model* model_;
  std::vector<RunData> runs_;
  AccurateOptions options_;
  std::vector<Level> levels_;  // created when first needed, then kept
  std::size_t at_ = 0;
  double error_ = 0.0;
};

}  // namespace shaker::estimator
