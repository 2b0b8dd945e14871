// The same least-squares problem through Ceres' trust region, around the same periodic solver.
//
// Ceres serves as the second opinion: tests hold the estimator's optimum against it, and the
// benchmarks quote their ratio to it. It is not the daemon's method: it asks for residuals and
// Jacobians at one theta after another, so every inner solution must be converged before the next
// step (no lifting), and it allocates in its loop.
#pragma once

#include <vector>

#include "estimator/estimation.hpp"

namespace shaker::estimator {

struct CeresFit {
  bool converged = false;
  std::vector<double> theta;
  double sum_of_squares = 0.0;
  int iterations = 0;
};

// One problem, solved as often as asked. One thread. Data on equal steps only (RunData::tau empty);
// throws std::invalid_argument otherwise.
class CeresEstimator {
 public:
  CeresEstimator(const Model& model, std::vector<RunData> runs, EstimationOptions options = {});
  ~CeresEstimator();
  CeresFit fit(const std::vector<double>& start);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace shaker::estimator
