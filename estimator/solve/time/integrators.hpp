// One constructor function for each integrator: for the sources of this room, and for callers that
// need fixed steps without the libraries of CVODES.
#pragma once

#include <memory>
#include <vector>

#include "estimator/solve/time/integration.hpp"

namespace shaker::estimator {

std::unique_ptr<TimeIntegration> make_runge_kutta(const StateEquations& equations,
                                                  const TimeOptions& options,
                                                  std::vector<int> free);
// For friction that jumps at TimeOptions::still. Throws std::invalid_argument for a model that has not
// exactly one velocity.
std::unique_ptr<TimeIntegration> make_stick_slip(const StateEquations& equations,
                                                 const TimeOptions& options, std::vector<int> free);
std::unique_ptr<TimeIntegration> make_implicit_runge_kutta(const StateEquations& equations,
                                                           const TimeOptions& options,
                                                           std::vector<int> free);
std::unique_ptr<TimeIntegration> make_cvodes(const StateEquations& equations,
                                             const TimeOptions& options, std::vector<int> free);
// Central differences around `inner`, which integrates without sensitivities.
std::unique_ptr<TimeIntegration> make_differences(const StateEquations& equations,
                                                  std::unique_ptr<TimeIntegration> inner,
                                                  std::vector<int> free);

}  // namespace shaker::estimator
