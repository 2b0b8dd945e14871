// The force that a model lacks along the measured motion: x - u'' - forces, per unit mass.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/fit/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// One cycle on equal steps.
struct MissingForce {
  Eigen::VectorXd stroke, velocity, force;
  bool ok = false;
};

// Not `ok` where the model has no force along a measured motion. `measured`: harmonics of the
// response. Internal coordinates are those of the prediction. Of an
// imposed motion it is the measured force less the predicted one (at the prediction's theta).
MissingForce missing_force(const Prediction& prediction, const std::vector<double>& theta,
                           const Eigen::VectorXd& measured);

// Where the force lies, of all runs together: the part of the motion in which most of it is found
// in the least time, in words. `before` and `after` have the same runs.
Location locate(const std::vector<MissingForce>& before, const std::vector<MissingForce>& after,
                const std::vector<RunDatum>& data);
std::string where(const std::vector<MissingForce>& force, const std::vector<RunDatum>& data,
                  double* share = nullptr);

}  // namespace shaker::estimator::diagnosis
