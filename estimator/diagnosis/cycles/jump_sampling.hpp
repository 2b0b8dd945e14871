// What samples do not show of a jump. Between two samples nobody knows where it is, so each harmonic of a
// cycle is wrong by up to 1 / N of the jump, with N samples a cycle. Where every cycle is sampled at the
// same phases (a round rate over a round frequency) the error is the same in all: their scatter does not
// show it. Where the phases repeat after two or three cycles, so does the error.
#pragma once

#include <vector>

#include <Eigen/Dense>

namespace shaker::estimator::diagnosis {

struct JumpSampling {
  std::vector<double> offsets;  // of each cycle's first sample, in sampling intervals
  double most = 0.0;            // of an error in one number of one cycle
  // At phases in equal steps, as many as all cycles are sampled at: by how much the course jumps there
  // within one step; 0 where it does not. Empty if they are sampled at many.
  std::vector<double> jumps;
  double first_phase = 0.0;  // the first of them, in steps
  // Of the mean of the cycles, in its first `size` numbers. Zero where nothing jumps.
  Eigen::MatrixXd covariance_of_mean(Eigen::Index size) const;
};

// Collects what the harmonics leave of the cycles, by phase. Noise averages out over the cycles, what the
// harmonics do not follow stays.
class LeftByHarmonics {
 public:
  LeftByHarmonics(double samples_a_cycle, int harmonics)
      : samples_(samples_a_cycle), harmonics_(harmonics) {}
  // A cycle. `tau`: phases of the samples, in [0, 1). `left`: as many numbers.
  void add(const std::vector<double>& tau, const Eigen::VectorXd& left);
  JumpSampling sampling() const;

 private:
  double samples_;
  int harmonics_;
  std::vector<double> offsets_, tau_, left_;
};

}  // namespace shaker::estimator::diagnosis
