// Applies the instruments of a model to a sampled displacement.
#pragma once

#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/records/internal/transient_run.hpp"
#include "estimator/model/model.hpp"

namespace shaker::estimator::diagnosis {

// A sampled course and its derivatives: samples x columns. The columns from `first_parameter` on are
// the model's parameters.
struct SampledCourse {
  Eigen::VectorXd value;
  Eigen::MatrixXd slopes;
};

// Replaces the displacement by what the instruments show. `load`: the damper's (transient_load.hpp),
// with the same columns; only read if sees_load(model).
void observe_samples(const Model& model, const std::vector<double>& theta, const SampledRun& run,
                     const SampledCourse& load, Eigen::Index first_parameter,
                     SampledCourse& displacement);

}  // namespace shaker::estimator::diagnosis
