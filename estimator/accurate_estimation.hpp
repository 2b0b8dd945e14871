// An estimate to an accuracy that is asked for: the grid is refined until theta no longer depends
// on it.
//
// 1, 2, 4, 6, 8, 12, ... times the points of the first grid, each fit the start of the next; how
// the differences of theta shrink from grid to grid tells what is left of the discretisation's
// error (periodic/grid_error.hpp). That error is a bias: no amount of data averages it out.
#pragma once

#include <memory>
#include <vector>

#include "estimator/estimation.hpp"

namespace shaker::estimator {

struct AccurateOptions {
  // grid.points: of the first grid, at the least the data's own; the tolerance follows `accuracy`.
  EstimationOptions estimation{.grid = {Scheme::order6, 40, true}};
  double accuracy = 1e-9;  // of every free parameter, relative
  int most_points = 4000;  // a period
};

// Workspace for one model and one set of runs; one thread. After the first fit on data of one shape
// that took as many grids nothing allocates.
class AccurateEstimator {
 public:
  // Throws as Estimator does.
  AccurateEstimator(const Model& model, std::vector<RunData> runs, AccurateOptions options = {});

  const Fit& fit(const std::vector<double>& start);

  // Estimated error of the last fit's theta, relative; infinite when it did not converge on three
  // grids.
  double error() const { return error_; }
  bool reached() const { return error_ <= options_.accuracy; }
  int points() const { return ring() / runs_.front().periods; }
  // The estimator on the finest grid of the last fit.
  Estimator& finest() { return *levels_[at_].estimator; }
  const Estimator& finest() const { return *levels_[at_].estimator; }

 private:
  // Points of the first run's grid, all of its periods.
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
  std::vector<Level> levels_;  // made when first needed, and kept
  std::size_t at_ = 0;
  double error_ = 0.0;
};

}  // namespace shaker::estimator
