// What samples do not show of a jump. Between two samples nobody knows where it is, so each harmonic of a
// cycle is wrong by up to 1 / N of the jump, with N samples a cycle. Where every cycle is sampled at the
// same phases (a round rate over a round frequency) the error is the same in all: their scatter does not
// show it. Where the phases repeat after two or three cycles, so does the error.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Dense>

namespace shaker::estimator::diagnosis {

struct JumpSampling {
  std::vector<double>
      jumps;  // by how much the course jumps at each of N phases; 0 where it does not
  std::vector<double> offsets;  // of each cycle's first sample, in sampling intervals
  // The most of an error in one number of one cycle.
  double most() const;
  // Of the mean of the cycles, in its first `size` numbers. Zero where nothing jumps.
  Eigen::MatrixXd covariance_of_mean(Eigen::Index size) const;
};

// Collects what the harmonics leave of the cycles, by phase. Noise averages out over the cycles, what the
// harmonics do not follow stays.
class LeftByHarmonics {
 public:
  LeftByHarmonics(double samples_a_cycle, int harmonics);
  // `tau`: phases of the samples, in [0, 1). `left`: as many numbers.
  void add(const std::vector<double>& tau, const Eigen::VectorXd& left);
  // As JumpSampling::jumps.
  std::vector<double> jumps() const;

 private:
  std::vector<double> sum_, count_;
  double followed_;  // of a jump, over a sampling interval
};

}  // namespace shaker::estimator::diagnosis
