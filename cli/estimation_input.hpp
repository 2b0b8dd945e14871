// The input of an estimation from files: the model and the runs, from campaigns (databases or
// folders, several of one damper together) or from one run as CSV. The commands that estimate
// share it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/model.hpp"
#include "estimator/fit/estimation.hpp"

namespace shaker::cli {

struct InputOptions {
  std::vector<std::filesystem::path> files;  // campaigns, or one CSV file
  std::filesystem::path model;               // empty: the model in the database
  std::optional<double> frequency_hz, amplitude;
  bool harmonics = false;  // Fourier coefficients with their covariance instead of samples
  std::vector<std::string> periods;  // M or RUN=M, see periods_of_runs.hpp

  // The first of `files`; empty where there is none.
  std::filesystem::path file() const { return files.empty() ? std::filesystem::path() : files[0]; }
  std::string names() const;  // of all files, for messages
};

struct EstimationInput {
  config::ModelSpec model;
  std::vector<estimator::RunData> runs;
  std::optional<std::string> campaign;
  std::optional<long> cycles;         // number of single cycles, when --periods groups them
  std::vector<std::string> warnings;  // about runs that do not repeat as assumed
  bool spoiled = false;               // the mean cycle of one of them is meaningless
};

// Returns an Error when length unit and gravity belong to different systems of units.
Result<void> check_units(const config::ModelSpec& model);

// An Error names the file and what is missing or wrong.
Result<EstimationInput> read_estimation_input(const InputOptions& options);

}  // namespace shaker::cli
