// Reads several measured channels from a file, for the objectives that weight them by their
// noise.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "cli/estimation_input.hpp"
#include "estimator/fit/objectives/channels.hpp"

namespace shaker::cli {

struct ChannelInput {
  config::ModelSpec model;
  std::vector<estimator::ChannelRun> runs;
  std::vector<estimator::Quantity> quantities;
  std::vector<std::string> units;  // of the file's numbers, one for each channel
  std::vector<double> scale;       // file's number / model's number: the mass for a force
  std::optional<std::string> campaign;
};

// `channels`: "displacement", "acceleration" (of the sprung mass, absolute, m/s^2), "force" (of
// a load cell, N; needs `mass`, the mass in kg that it carries; a database may contain it). In
// a CSV file they are columns. In a database they are raw samples: the last periods of each
// run, at most as many as there are accepted cycles, are resampled on the points of the cycle,
// in phase with the recorded displacement. An Error names the file and what is missing.
Result<ChannelInput> read_channels(const InputOptions& options,
                                   const std::vector<std::string>& channels,
                                   std::optional<double> mass);

}  // namespace shaker::cli
