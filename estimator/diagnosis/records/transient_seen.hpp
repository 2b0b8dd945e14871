// What the instruments of a model make of a sampled displacement.
#pragma once

#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/records/transient_run.hpp"
#include "estimator/model/model.hpp"

namespace shaker::estimator::diagnosis {

// Throws std::invalid_argument when the model has an instrument that wants the damper's load, which
// only a periodic solution has.
void check_instruments(const Model& model);

// `samples` of the displacement and their slopes become what is seen of them. Columns of `slopes`
// from `first_parameter` on are the model's parameters.
void observe_samples(const Model& model, const std::vector<double>& theta, const SampledRun& run,
                     Eigen::VectorXd& samples, Eigen::MatrixXd& slopes,
                     Eigen::Index first_parameter);

}  // namespace shaker::estimator::diagnosis
