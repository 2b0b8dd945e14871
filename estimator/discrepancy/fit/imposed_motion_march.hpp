// The force of a model along a motion that is imposed and known at even steps: effects with memory
// are carried along in time, from rest at the first step, by the second backward difference
// formula, which forgets what is stiff. For motions that are not periodic, and for load paths with
// play, where no smooth course over a cycle exists to be found.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Dense>

#include "estimator/model.hpp"
#include "estimator/model_arrays.hpp"

namespace shaker::estimator::discrepancy {

struct Motion {
  double dt = 0.0;
  Eigen::VectorXd u, v, a, x;  // x: the excitation, empty for none
};

// The model parts its load path: some coordinate is the damper's own stroke behind a play.
bool parts_in_series(const Model& model);

class MotionMarch {
 public:
  // `inertia`: M u'' counts. Throws std::invalid_argument for a model of several mechanical
  // coordinates or with a memory that has inertia. `model` must outlive it.
  MotionMarch(const Model& model, Motion motion, bool inertia);

  // False when a step cannot be solved or a point is inadmissible.
  bool at(std::span<const double> theta);
  const Eigen::VectorXd& force() const { return force_; }  // of the first equation, x included
  const Eigen::MatrixXd& slope() const { return slope_; }  // over theta
  const Motion& motion() const { return motion_; }

 private:
  bool march(std::span<const double> theta);
  bool step(int i, std::span<const double> theta);

  const Model* model_;
  Motion motion_;
  bool inertia_;
  int n_, s_, p_, q_;      // q: coordinates that are carried along
  Eigen::VectorXd first_;  // of what is carried along
  Eigen::VectorXd force_;
  Eigen::MatrixXd slope_;
  Eigen::MatrixXd w_, w_dot_;                           // n x q
  std::vector<Eigen::MatrixXd> s_w_;                    // q x p, of the last three steps
  std::vector<Eigen::MatrixXd> w_theta_, w_dot_theta_;  // each carried coordinate: n x p
  // Arrays for one point, and for all of them.
  ModelArrays one_, all_;
};

}  // namespace shaker::estimator::discrepancy
