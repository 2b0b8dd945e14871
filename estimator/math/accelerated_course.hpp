// Steps of an iteration that converges slowly along a few directions, made longer: Anderson
// acceleration (Anderson 1965; Walker and Ni 2011). Gauss-Newton steps for few unknowns are such an
// iteration where much is left of the data.
#pragma once

#include <Eigen/Dense>

namespace shaker::estimator {

class AcceleratedCourse {
 public:
  // The step to take in place of `step`, the iteration's own at the present place; both n. `weight`
  // (n x n, positive definite): the metric. Returns `step` unless `straight`, and at the first call
  // after forget().
  Eigen::VectorXd next(const Eigen::VectorXd& step, const Eigen::MatrixXd& weight, bool straight);
  // The iteration is at another place than next() has led to.
  void forget();

 private:
  Eigen::VectorXd step_, taken_;    // of the call before
  Eigen::MatrixXd changes_, ways_;  // of the steps, and of the places: newest first
};

}  // namespace shaker::estimator
