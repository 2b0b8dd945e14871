// Several channels of a rig from a file, for the objectives that weigh them against each other.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "cli/estimation_input.hpp"
#include "estimator/objectives/channels.hpp"

namespace shaker::cli {

struct ChannelInput {
  config::ModelSpec model;
  std::vector<estimator::ChannelRun> runs;
  std::vector<estimator::Quantity> quantities;
  std::vector<std::string> units;  // of the file's numbers
  std::vector<double> scale;       // the file's numbers over the model's: the mass for a force
  std::optional<std::string> campaign;
};

// `channels`: "displacement", "acceleration" (of the sprung mass in space, m/s^2), "force" (a load
// cell's, N; needs `mass`, kg, that it carries). A CSV file has them as columns. A database has
// them as raw samples: the last periods of each run, as many as were accepted, put on the cycle's
// grid in phase with the recorded displacement.
Result<ChannelInput> read_channels(const InputOptions& options,
                                   const std::vector<std::string>& channels,
                                   std::optional<double> mass);

}  // namespace shaker::cli
