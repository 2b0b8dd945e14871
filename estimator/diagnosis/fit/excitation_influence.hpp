// How the response of a record follows its excitation: the equations linearised along the
// trajectory, carried forward in time.
#pragma once

#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/records/transient_run.hpp"
#include "estimator/model/model.hpp"

namespace shaker::estimator::diagnosis {

// The response's first `keep` cosines over the excitation's first `count`, from an initial state
// that stays. `states`: of the trajectory at `theta`, a row a sample. No columns where the
// equations cannot be had.
Eigen::MatrixXd over_excitation(const Model& model, const std::vector<double>& theta,
                                const SampledRun& run, const Eigen::MatrixXd& states,
                                Eigen::Index keep, Eigen::Index count);

}  // namespace shaker::estimator::diagnosis
