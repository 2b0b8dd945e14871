// The force that a model lacks along the measured motion: x - u'' - forces, per unit mass.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// One cycle on equal steps.
struct MissingForce {
  Eigen::VectorXd stroke, velocity, force;
  bool ok = false;
};

// Computes the missing force along the measured motion. `measured`: harmonics of the response. The
// internal coordinates are those of the prediction. For an imposed motion it is the measured force
// minus the predicted one, at the theta of the prediction. Not `ok` if the model has no force along
// a measured motion.
MissingForce missing_force(const Prediction& prediction, const std::vector<double>& theta,
                           const Eigen::VectorXd& measured);

// Describes in words where the force acts, over all runs: the part of the motion with most of the
// force in the least time. `before` and `after` have the same runs.
Location locate(const std::vector<MissingForce>& before, const std::vector<MissingForce>& after,
                const std::vector<RunDatum>& data);
std::string where(const std::vector<MissingForce>& force, const std::vector<RunDatum>& data,
                  double* share = nullptr);

}  // namespace shaker::estimator::diagnosis
