// From a file to what the estimator takes: one RunData a run. Pure but for reading the files.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "base/result.hpp"
#include "cli/csv.hpp"
#include "cli/periods_of_runs.hpp"
#include "config/model.hpp"
#include "estimator/estimation.hpp"

namespace shaker::cli {

struct Dwell {
  double frequency_hz = 0.0;
  std::optional<double> amplitude;  // of a pure cosine; needed when there is no excitation column
  bool harmonics = false;           // Fourier coefficients of the cycles, with their covariance
};

// Columns t,y or t,displacement (the excitation is amplitude * cos(2 pi f t)), or
// t,excitation,displacement (as it was
// measured: its mean, which no table can have, and what is above the 8th harmonic are left out).
// Any number of periods, whole or not, evenly sampled or not; t must increase. At least 8 points.
Result<CsvTable> read_run_table(const std::filesystem::path& file);
Result<estimator::RunData> run_from_table(const CsvTable& table, const std::string& origin,
                                          const Dwell& dwell);

// Samples in a period when they stand at i / n of periods from a whole one on; else 0.
std::size_t points_of_equal_steps(const std::vector<double>& t, double frequency_hz);

struct CampaignData {
  std::string name;
  std::string model_json;
  std::vector<estimator::RunData> runs;  // the mean of the accepted cycles of each
  int cycles = 0;
  std::vector<std::string> warnings;  // of runs that do not repeat as they are taken to
  bool spoiled = false;               // the mean cycle of one of them says nothing
};
// An Error when the file is no campaign, or holds no accepted cycle. Runs that are said to repeat
// after several periods need none: see run_over_periods.hpp.
Result<CampaignData> runs_from_database(const std::filesystem::path& file, bool harmonics = false,
                                        const PeriodsOfRuns& periods = {});

}  // namespace shaker::cli
