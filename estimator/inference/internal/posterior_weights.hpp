// Pareto smoothing of importance weights (Vehtari, Simpson, Gelman, Yao and Gabry 2024). Private to
// the sources of posterior.hpp.
#pragma once

#include <vector>

namespace shaker::estimator {

// Replaces the largest weights by quantiles of the generalised Pareto distribution that is
// fitted to them. Returns its shape k: above 0.7 means have no useful error; minus infinity if
// all weights in the tail are equal, infinity if there are too few weights or the fit fails.
double smooth_weights(std::vector<double>& weight);

}  // namespace shaker::estimator
