// Convergence of Markov chains with different starts: rank-normalised split R-hat, and the
// effective number of draws for a mean by Geyer's initial monotone sequence (Vehtari, Gelman,
// Simpson, Carpenter and Buerkner 2021). Private to the sources of posterior.hpp.
#pragma once

#include <vector>

namespace shaker::estimator {

// The larger R-hat of location and of spread (folded chains); 1 if the halves of all chains agree.
// The chains have equal length: two or more chains of four or more draws.
double split_r_hat(const std::vector<std::vector<double>>& chains);

// Number of independent draws with variance `variance` whose mean is as accurate as the mean of all
// chains.
double effective_of_chains(const std::vector<std::vector<double>>& chains, double variance);

}  // namespace shaker::estimator
