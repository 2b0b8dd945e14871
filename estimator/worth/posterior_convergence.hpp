// Whether chains that started apart tell the same, and what their draws are worth: rank-normalised
// split R-hat, and effective draws for a mean by Geyer's initial monotone sequence (Vehtari,
// Gelman, Simpson, Carpenter and Buerkner 2021). Private to the sources of posterior.hpp.
#pragma once

#include <vector>

namespace shaker::estimator {

// The larger one of location and spread (folded); 1 where the halves of all chains agree. Chains
// of equal length, two or more, four draws or more.
double split_r_hat(const std::vector<std::vector<double>>& chains);

// Independent draws of variance `variance` that the mean of all chains is worth.
double effective_of_chains(const std::vector<std::vector<double>>& chains, double variance);

}  // namespace shaker::estimator
