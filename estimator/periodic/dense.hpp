// The dense matrices of Fourier collocation. Private to PeriodicSystem's sources.
#pragma once

#include <Eigen/Dense>

#include "estimator/periodic/periodic_system.hpp"

namespace shaker::estimator {

struct PeriodicSystem::Dense {
  Eigen::MatrixXd first, second, jacobian, right;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu;
};

}  // namespace shaker::estimator
