// What is left when nothing of the catalogue explains it: the shape of the force that the model
// still lacks, over stroke and velocity.
//
// A smooth surface of cubic B-splines, whose prior is a Gaussian process: how smooth it is along
// either axis, how large, and whether more than the stated noise is left beside it, is what makes
// the residuals most probable. What the parameters could do instead is taken out twice: from the
// residuals, along the fit's Jacobian, and from the surface, along the derivatives of the model's
// force over its parameters; so that it is the part of the force that no parameter can imitate.
// C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine Learning (2006), ch. 2, 5.
#pragma once

#include <optional>
#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/fit/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// Of the runs that were fitted. `errors_of_model`: the standard errors hold what a model left, so
// that the noise may be less. Nothing for models of several masses, and where no run tells.
std::optional<RemainingForce> remaining_force(const HarmonicFit& fit,
                                              const std::vector<RunDatum>& data,
                                              bool errors_of_model);

}  // namespace shaker::estimator::diagnosis
