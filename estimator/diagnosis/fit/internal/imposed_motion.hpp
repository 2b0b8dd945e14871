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

#include "estimator/diagnosis/fit/internal/memory_ring.hpp"
#include "estimator/diagnosis/fit/internal/motion_integrator.hpp"
#include "estimator/model/model.hpp"
#include "estimator/model/model_arrays.hpp"

namespace shaker::estimator::diagnosis {

class ImposedMotion {
 public:
  // `motion`: harmonics of the displacement. Throws std::invalid_argument for a model of several
  // mechanical coordinates. `model` must outlive it.
  ImposedMotion(const Model& model, double frequency_hz, const Eigen::VectorXd& motion, int points);

  // Returns false if the memory has no periodic solution or a point is inadmissible. Without
  // `slopes`, slope() is undefined.
  bool at(std::span<const double> theta, bool slopes = true);
  // Starts the search from the solution of another object, for the same or a nearby motion.
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
  void put_memory(const Eigen::MatrixXd& memory);
  bool predict_memory(std::span<const double> theta);
  bool converge(std::span<const double> theta);
  bool solve_memory(std::span<const double> theta);

  const Model* model_;
  int n_, s_, p_, memory_;
  double frequency_;
  Eigen::VectorXd motion_;
  std::vector<double> theta_;
  Eigen::VectorXd u_, v_, a_, force_;
  Eigen::MatrixXd slope_;
  ModelArrays at_;  // the motion, then the memories
  std::optional<MemoryRing> ring_;
  // Memories, points x memories: at rest, and the last solution or at first that of another object.
  Eigen::MatrixXd rest_, solved_, trial_;
  std::vector<double> solved_at_;  // theta of the last solution; empty: none, or another object's
  Eigen::MatrixXd over_theta_;     // its derivatives: a memory's columns, then the next one's
  std::unique_ptr<MotionIntegrator> integrator_;  // of parts in series
};

}  // namespace shaker::estimator::diagnosis
