// The replications of `shakerctl monte-carlo` in files: a part a file, one line of JSON each.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/shard.hpp"
#include "estimator/inference/monte_carlo.hpp"

namespace shaker::cli {

// What all parts of one computation have in common: the options but for the threads.
std::string described(const estimator::Model& model, const estimator::MonteCarloOptions& options);

// Writes `part`, which are the replications of `shard`. Throws std::runtime_error where the file
// cannot be written.
void keep(const std::vector<estimator::Replication>& part, const Shard& shard,
          const std::string& description, const std::filesystem::path& file);

// All `count` replications, in their order. Throws std::runtime_error with the place for a file of
// other options, a line that cannot be read, and a replication that is missing or there twice.
std::vector<estimator::Replication> merge(long count, const std::string& description,
                                          const std::vector<std::filesystem::path>& files);

}  // namespace shaker::cli
