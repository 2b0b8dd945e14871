// The remaining force if nothing in the catalogue explains the data: its shape over stroke and
// velocity.
//
// It is a smooth surface of cubic B-splines with a Gaussian process as prior. Its smoothness along
// both axes, its size and the noise in addition to the stated one are those that make the residuals
// most probable. The influence of the parameters is removed twice: from the residuals, along the
// Jacobian of the fit, and from the surface, along the derivatives of the model's force with
// respect to its parameters. The surface is thus the part of the force that no parameter can
// imitate. C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine Learning (2006),
// ch. 2, 5.
#pragma once

#include <optional>
#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/force/internal/force_surface.hpp"

namespace shaker::estimator::diagnosis {

// Estimates the remaining force from the fitted runs. `errors_of_model`: the standard errors
// include the residual of a model, so the noise may be smaller. Empty for models of several masses,
// and if no run determines it. `known`: from another fit's force of the same campaign, or empty.
std::optional<RemainingForce> remaining_force(const HarmonicFit& fit,
                                              const std::vector<RunDatum>& data,
                                              bool errors_of_model, SeenPriors& known);

}  // namespace shaker::estimator::diagnosis
