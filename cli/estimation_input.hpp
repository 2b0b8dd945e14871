// What an estimation from files starts with: the model and the runs, from a campaign database or
// from one run as CSV. Shared by the commands that estimate.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/model.hpp"
#include "estimator/estimation.hpp"

namespace shaker::cli {

struct InputOptions {
  std::filesystem::path file;
  std::filesystem::path model;  // empty: the database's own
  std::optional<double> frequency_hz, amplitude;
  bool harmonics = false;  // Fourier coefficients with their covariance instead of samples
  std::vector<std::string> periods;  // M or RUN=M, see periods_of_runs.hpp
};

struct EstimationInput {
  config::ModelSpec model;
  std::vector<estimator::RunData> runs;
  std::optional<std::string> campaign;
  std::optional<long> cycles;         // single ones, where runs are said to be groups of them
  std::vector<std::string> warnings;  // of runs that do not repeat as they are taken to
  bool spoiled = false;               // the mean cycle of one of them says nothing
};

// An Error when length unit and gravity belong to different systems of units.
Result<void> check_units(const config::ModelSpec& model);

bool is_database(const std::filesystem::path& file);  // by its name

// An Error names the file and what is missing or wrong.
Result<EstimationInput> read_estimation_input(const InputOptions& options);

}  // namespace shaker::cli
