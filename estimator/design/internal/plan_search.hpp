// The search for the best sets of runs. Private to the sources of the plan.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "estimator/design/internal/plan_criteria.hpp"

namespace shaker::estimator {

// Of a set of runs; a smaller value is better.
using Criterion = std::function<double(const RunShares&)>;

// The best sets of `size` runs with equal shares, at most `keep`: those that greedy search from
// several single runs and exchange find, and their neighbours that differ by one run. A run may occur
// twice, which means twice as many cycles of it. `possible`: the candidates to choose from.
std::vector<std::vector<std::size_t>> best_sets(int size, int keep,
                                                const std::vector<std::size_t>& possible,
                                                const Criterion& criterion);

// Moves rig time between the runs of a set until no move helps.
RunShares best_shares(std::vector<std::size_t> runs, const Criterion& criterion);

}  // namespace shaker::estimator
