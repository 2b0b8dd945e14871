// One estimate for each of many records of the same run, for example for a bootstrap, a Monte Carlo
// study or a long recording cut into cycles. The method is Estimator's lifted one. It fits eight
// records in the lanes of a batch, and threads share the batches.
//
// The result of a record depends on that record only. It is bitwise the same in any order, beside
// any other records (whether they converge or not), and with any number of threads.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "estimator/fit/estimation.hpp"

namespace shaker::estimator {

// Row i holds the result of record i.
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
  // `run` gives excitation, weights and number of points; the values of its displacement are not
  // used. `model` must outlive the object. Throws std::invalid_argument as Estimator does, and for
  // a run that is not on equal steps or holds Fourier coefficients.
  BatchEstimator(const Model& model, const RunData& run, EstimationOptions options = {},
                 int threads = 1);
  ~BatchEstimator();

  // Fits from `start` (all parameters). `records`: records x points of the run, row by row. Throws
  // std::invalid_argument if they are no whole number of records or not finite. The result is valid
  // until the next call. A further call with as many records allocates only for the threads, and
  // for records that the batch passes on to Estimator.
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
