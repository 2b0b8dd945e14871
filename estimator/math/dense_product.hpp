// Products of dense matrices, and what is made of them, in the widest registers of the machine.
// Eigen's are compiled for SSE2, which every x86-64 has, and take three times as long on one with
// AVX2.
#pragma once

#include <Eigen/Core>

#include "estimator/math/aligned.hpp"

namespace shaker::estimator {

// a b, for matrices of any size. Allocates; thread-safe.
Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
// a a^T
Eigen::MatrixXd product_with_own(const Eigen::MatrixXd& a);
// l^-1 b for the lower triangle l of a square matrix.
Eigen::MatrixXd lower_quotient(const Eigen::MatrixXd& l, Eigen::MatrixXd b);
// q^T b for the q = h_0 h_1 ... of Householder's tridiagonalisation of an n x n matrix, n - 1
// reflections h_k = 1 - factors[k] v v^T. v is zero down to row k, one at row k + 1, and below that
// the column k of `reflectors`.
Eigen::MatrixXd reflected(const Eigen::MatrixXd& reflectors, const Eigen::VectorXd& factors,
                          const Eigen::MatrixXd& b);

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
