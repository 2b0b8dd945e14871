// Real harmonics of a period: [mean, cos 1, sin 1, cos 2, sin 2, ...], 2 H + 1 numbers.
#pragma once

#include <map>
#include <memory>
#include <utility>

#include <Eigen/Dense>

#include "estimator/math/dense_product.hpp"

namespace shaker::estimator::diagnosis {

inline Eigen::Index harmonic_size(int harmonics) {
  return 1 + 2 * static_cast<Eigen::Index>(harmonics);
}

// Order of a component: 0, 1, 1, 2, 2, ...
inline int harmonic_order(Eigen::Index component) {
  return static_cast<int>((component + 1) / 2);
}

// Over time, of what repeats `frequency_hz` times a second.
Eigen::VectorXd derivative(const Eigen::VectorXd& harmonics, double frequency_hz);

// (2 H + 1) x n: turns n equally spaced points of a period into its harmonics.
Eigen::MatrixXd analysis_matrix(int harmonics, int points);
// Such matrices, each made once. Not for several threads.
class AnalysisMatrices {
 public:
  std::shared_ptr<const LeftFactor> get(int harmonics, int points);

 private:
  std::map<std::pair<int, int>, std::shared_ptr<const LeftFactor>> made_;
};
// n x (2 H + 1): and back.
Eigen::MatrixXd synthesis_matrix(int harmonics, int points);
// That of one curve, without the matrix.
Eigen::VectorXd synthesised(const Eigen::VectorXd& harmonics, int points);

// The same curve seen from a later origin: c(tau + turns).
void shift_origin(Eigen::Ref<Eigen::VectorXd> harmonics, double turns);
// What a first-order low pass with time constant `lag` (in periods over 2 pi: omega tau) makes of
// it.
void low_pass(Eigen::Ref<Eigen::VectorXd> harmonics, double omega_lag);

}  // namespace shaker::estimator::diagnosis
