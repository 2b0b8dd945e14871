// The frame that Newton, Gauss-Newton and modified Gauss-Newton share: a direction, then a step
// along it. Internal to the folder.
#pragma once

#include <functional>

#include "estimator/optimise/evaluator.hpp"

namespace shaker::estimator::optimise {

enum class StepRule {
  full,        // pure: the whole step, halved only while inadmissible
  length,      // step-length search: phi falls at every step (Armijo, quadratic interpolation)
  relaxation,  // under-relaxed in the first iterations, then full
};

// What a direction is made from: the free parameters only.
struct Local {
  const Point& point;
  const std::vector<int>& free;
  Eigen::MatrixXd jacobian;  // free columns
  double progress = 1.0;     // relative decrease of phi in the last step; 1 at first, 0 after a
                             // direction that led nowhere
};

// Direction over the free parameters. False when none can be had.
using Direction = std::function<bool(const Local& local, Eigen::VectorXd& step)>;

// `retries`: how often another direction is asked for at a point where one led nowhere.
Summary descend(const char* method, Evaluator& evaluator, const Eigen::VectorXd& start,
                StepRule rule, const Direction& direction, int retries = 0);

}  // namespace shaker::estimator::optimise
