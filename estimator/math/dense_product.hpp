// Products of dense matrices in the widest registers of the machine. Eigen's are compiled for
// SSE2, which every x86-64 has, and take three times as long on one with AVX2.
#pragma once

#include <Eigen/Core>

#include "estimator/math/aligned.hpp"

namespace shaker::estimator {

// a b, for matrices of any size. Allocates; thread-safe.
Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
// a a^T
Eigen::MatrixXd product_with_own(const Eigen::MatrixXd& a);

// The left factor of many products, arranged once. Immutable: all threads may use one.
class LeftFactor {
 public:
  explicit LeftFactor(Eigen::MatrixXd matrix);
  const Eigen::MatrixXd& matrix() const { return matrix_; }
  // matrix() b
  Eigen::MatrixXd times(const Eigen::MatrixXd& b) const;

 private:
  Eigen::MatrixXd matrix_;
  AlignedVector tiles_;
};

}  // namespace shaker::estimator
