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
};

struct EstimationInput {
  config::ModelSpec model;
  std::vector<estimator::RunData> runs;
  std::optional<std::string> campaign;
};

// An Error when length unit and gravity belong to different systems of units.
Result<void> check_units(const config::ModelSpec& model);

bool is_database(const std::filesystem::path& file);  // by its name

// An Error names the file and what is missing or wrong.
Result<EstimationInput> read_estimation_input(const InputOptions& options);

}  // namespace shaker::cli
