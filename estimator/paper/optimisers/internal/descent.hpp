// The common iteration of Newton, Gauss-Newton and modified Gauss-Newton: a direction, then a step
// along it. Internal to the folder.
#pragma once

#include <functional>

#include "estimator/paper/optimisers/internal/evaluator.hpp"

namespace shaker::estimator::optimisers {

enum class StepRule {
  full,        // the whole step, halved only while it is inadmissible
  length,      // line search: phi decreases at every step (Armijo, quadratic interpolation)
  relaxation,  // under-relaxed in the first iterations, then full
};

// Input of a direction, for the free parameters only.
struct Local {
  const Point& point;
  const std::vector<int>& free;
  Eigen::MatrixXd jacobian;  // free columns
  double progress = 1.0;     // relative decrease of phi in the last step; 1 at first, 0 after a
                             // direction without a decrease
};

// Computes a direction over the free parameters. Returns false when there is none.
using Direction = std::function<bool(const Local& local, Eigen::VectorXd& step)>;

// Minimises phi. `retries`: number of further directions at a point where one gave no decrease.
Summary descend(const char* method, Evaluator& evaluator, const Eigen::VectorXd& start,
                StepRule rule, const Direction& direction, int retries = 0);

}  // namespace shaker::estimator::optimisers
