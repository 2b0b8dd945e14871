// The force of a model along a motion that is imposed and periodic: a damper dynamometer.
//
// Nothing has to be solved for the motion; the effects' memory is, on the ring of the cycle, or,
// where parts of the load path are in series and play leaves them free, in time over two laps. The
// force is the sum of the effects at the measured motion: no inertia but that of effects that say
// so (added_mass), no excitation.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/fit/imposed_motion_bdf2.hpp"
#include "estimator/math/cyclic_banded_lu.hpp"
#include "estimator/model/model.hpp"
#include "estimator/model/model_arrays.hpp"
#include "estimator/periodic/scheme.hpp"

namespace shaker::estimator::diagnosis {

class ImposedMotion {
 public:
  // `motion`: harmonics of the displacement. Throws std::invalid_argument for a model of several
  // mechanical coordinates. `model` must outlive it.
  ImposedMotion(const Model& model, double frequency_hz, const Eigen::VectorXd& motion, int points);

  // False when the memory has no periodic course, or a point is inadmissible. Without `slopes`,
  // slope() is undefined.
  bool at(std::span<const double> theta, bool slopes = true);
  const Eigen::VectorXd& force() const { return force_; }
  const Eigen::MatrixXd& slope() const { return slope_; }  // over theta
  // Of the force of the last theta, over the harmonics of the motion, by differences: points x
  // harmonics, the mean first. 0 where a motion nearby is inadmissible.
  Eigen::MatrixXd over_motion() const;
  const Eigen::VectorXd& stroke() const { return u_; }
  const Eigen::VectorXd& velocity() const { return v_; }

 private:
  bool evaluate(std::span<const double> theta);
  double row_norm() const;
  bool factorise();
  bool solve_memory(std::span<const double> theta);
  void differentiate();
  double difference(const double* column, int i) const;

  const Model* model_;
  int n_, s_, p_, memory_;
  double frequency_;
  Eigen::VectorXd motion_;
  std::vector<double> theta_;
  Stencil stencil_ = upwind_stencil(Scheme::order4);
  Eigen::VectorXd u_, v_, a_, force_;
  Eigen::MatrixXd slope_;
  ModelArrays at_;  // the motion, then the memories
  CyclicBandedLu band_;
  std::vector<double> rows_;
  std::unique_ptr<MotionIntegrator> integrator_;  // of parts in series
};

}  // namespace shaker::estimator::diagnosis
