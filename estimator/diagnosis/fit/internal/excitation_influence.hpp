// The derivatives of a record's response with respect to its excitation: the equations, linearised
// along the trajectory and integrated in time.
#pragma once

#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/records/internal/transient_run.hpp"
#include "estimator/model/model.hpp"

namespace shaker::estimator::diagnosis {

// Derivatives of the response's first `keep` cosines with respect to the excitation's first
// `count`, with a fixed initial state. `states`: the trajectory at `theta`, one row for each
// sample. No columns if the model has no such equations.
Eigen::MatrixXd over_excitation(const Model& model, const std::vector<double>& theta,
                                const SampledRun& run, const Eigen::MatrixXd& states,
                                Eigen::Index keep, Eigen::Index count);

}  // namespace shaker::estimator::diagnosis
