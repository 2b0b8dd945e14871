// Solves the same least-squares problem by the trust region of Ceres, with the same solver for
// the periodic solutions.
//
// It serves as a second opinion: tests compare the estimator's optimum with it, and benchmarks
// state their ratio to it. The daemon does not use it. Ceres asks for residuals and Jacobians
// at one theta after another, so that every inner solution must converge before the next step
// (no lifting), and it allocates in its loop.
#pragma once

#include <vector>

#include "estimator/fit/estimation.hpp"

namespace shaker::estimator {

struct CeresFit {
  bool converged = false;
  std::vector<double> theta;
  double sum_of_squares = 0.0;
  int iterations = 0;
};

// One problem, which may be solved repeatedly. One thread at a time may use it. `model` must
// outlive it. Throws std::invalid_argument unless the data are on equal steps (RunData::tau
// empty).
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
