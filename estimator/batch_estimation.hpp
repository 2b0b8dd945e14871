// One estimate for each of many records of the same run: bootstrap, Monte Carlo, a long recording
// cut into cycles. The same method and the same numbers as Estimator's lifted one, with eight
// records abreast in SIMD lanes and packs of eight dealt out to threads.
//
// A record's result depends on that record alone: it is bitwise the same in any order, beside any
// neighbours (whether they converge or not), on any number of threads.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "estimator/estimation.hpp"

namespace shaker::estimator {

// Row i is of record i.
struct BatchFit {
  std::size_t records = 0, parameters = 0;
  std::vector<double> theta, standard_error;  // records x parameters
  std::vector<double> sum_of_squares, noise;
  std::vector<FitStatus> status;
  std::vector<int> iterations;
  std::span<const double> theta_of(std::size_t record) const {
    return {&theta[record * parameters], parameters};
  }
};

class BatchEstimator {
 public:
  // `run` gives excitation, weights and number of points; its own displacement counts for nothing
  // but its length. `model` must outlive this. Throws std::invalid_argument as Estimator does, and
  // for a run that is not on equal steps or holds Fourier coefficients.
  BatchEstimator(const Model& model, const RunData& run, EstimationOptions options = {},
                 int threads = 1);
  ~BatchEstimator();

  // `records`: one after another, each of the run's number of points, all finite (throws
  // otherwise). Valid until the next call. After the first call with as many records nothing
  // allocates but the threads themselves.
  const BatchFit& fit(std::span<const double> records, const std::vector<double>& start);

 private:
  struct Worker;
  void fit_pack(Worker& worker, std::size_t first);
  std::size_t points_ = 0;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::span<const double> records_;
  std::vector<double> start_;
  BatchFit fit_;
};

}  // namespace shaker::estimator
