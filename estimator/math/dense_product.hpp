// Products of dense matrices in the widest registers of the machine. Eigen's are compiled for
// SSE2, which every x86-64 has, and take three times as long on one with AVX2.
#pragma once

#include <Eigen/Core>

namespace shaker::estimator {

// a b, for matrices of any size. Allocates; thread-safe.
Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
// a a^T
Eigen::MatrixXd product_with_own(const Eigen::MatrixXd& a);

}  // namespace shaker::estimator
