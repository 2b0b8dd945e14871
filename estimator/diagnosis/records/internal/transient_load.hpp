// The load of the damper along a sampled motion, for instruments that yield under it.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Dense>

#include "estimator/solve/time/state_equations.hpp"

namespace shaker::estimator::diagnosis {

// Per unit of mass, m/s^2, at each sample, and its derivatives.
struct TransientLoad {
  Eigen::VectorXd value;
  Eigen::MatrixXd over_states;      // samples x states
  Eigen::MatrixXd over_parameters;  // samples x all parameters
};

// True if an instrument of the model sees the load.
bool sees_load(const Model& model);

// `states`: samples x states. `excitation`: one a sample, m/s^2. Empty where a state is inadmissible.
std::optional<TransientLoad> transient_load(const StateEquations& equations,
                                            const std::vector<double>& theta,
                                            const Eigen::VectorXd& excitation,
                                            const Eigen::MatrixXd& states);

}  // namespace shaker::estimator::diagnosis
