// Weights of importance sampling whose largest follow a Pareto tail (Vehtari, Simpson, Gelman, Yao
// and Gabry 2024). Private to the sources of posterior.hpp.
#pragma once

#include <vector>

namespace shaker::estimator {

// Replaces the largest weights by the quantiles of the generalised Pareto distribution that they
// follow, and returns its shape k: above 0.7 means have no useful error. Minus infinity where all
// weights are equal, infinity where there are too few to tell.
double smooth_weights(std::vector<double>& weight);

}  // namespace shaker::estimator
