// Applies the instruments of a model to a sampled displacement.
#pragma once

#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/records/internal/transient_run.hpp"
#include "estimator/model/model.hpp"

namespace shaker::estimator::diagnosis {

// Throws std::invalid_argument if an instrument of the model needs the damper's load, which only a
// periodic solution has.
void check_instruments(const Model& model);

// Replaces `samples` of the displacement and their derivatives by what the instruments show. The
// columns of `slopes` from `first_parameter` on are the model's parameters.
void observe_samples(const Model& model, const std::vector<double>& theta, const SampledRun& run,
                     Eigen::VectorXd& samples, Eigen::MatrixXd& slopes,
                     Eigen::Index first_parameter);

}  // namespace shaker::estimator::diagnosis
