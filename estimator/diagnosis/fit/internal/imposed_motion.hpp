// The force of a model along an imposed periodic motion, as on a damper dynamometer.
//
// The motion is known. Only the memory of the effects is solved for, on the ring of the cycle. If
// play leaves parts of the load path free, the memory is integrated in time over two cycles
// instead. The force is the sum of the effects at the measured motion. It includes no excitation,
// and inertia only of effects with inertia (added_mass).
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/fit/internal/imposed_motion_bdf2.hpp"
#include "estimator/math/cyclic_banded_lu.hpp"
#include "estimator/model/model.hpp"
#include "estimator/model/model_arrays.hpp"
#include "estimator/solve/periodic/scheme.hpp"

namespace shaker::estimator::diagnosis {

class ImposedMotion {
 public:
  // `motion`: harmonics of the displacement. Throws std::invalid_argument for a model of several
  // mechanical coordinates. `model` must outlive it.
  ImposedMotion(const Model& model, double frequency_hz, const Eigen::VectorXd& motion, int points);

  // Returns false if the memory has no periodic solution or a point is inadmissible. Without
  // `slopes`, slope() is undefined.
  bool at(std::span<const double> theta, bool slopes = true);
  // For parts in series: starts the search from the solution of another object, for the same or a
  // nearby motion.
  void start_from(const ImposedMotion& other);
  const Eigen::VectorXd& force() const { return force_; }
  const Eigen::MatrixXd& slope() const { return slope_; }  // over theta
  // Derivatives of the force at the last theta with respect to the harmonics of the motion, the
  // mean first, by differences: points x harmonics. Zero where a nearby motion is inadmissible.
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
  ModelArrays at_;                      // the motion, then the memories
  std::optional<CyclicBandedLu> band_;  // of the memories
  std::vector<double> rows_;
  std::unique_ptr<MotionIntegrator> integrator_;  // of parts in series
};

}  // namespace shaker::estimator::diagnosis
