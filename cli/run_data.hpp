// Converts files to the estimator's RunData, one for each run. Pure except for reading the
// files.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "base/result.hpp"
#include "cli/csv.hpp"
#include "cli/periods_of_runs.hpp"
#include "config/model.hpp"
#include "estimator/fit/estimation.hpp"
#include "estimator/signal/cycles.hpp"
#include "record/campaign_database.hpp"

namespace shaker::cli {

struct Dwell {
  double frequency_hz = 0.0;
  std::optional<double> amplitude;  // m/s^2, of a cosine; needed without an excitation column
  bool harmonics = false;           // Fourier coefficients of the cycles and their covariance
};

// Columns t,y or t,displacement (the excitation is then amplitude * cos(2 pi f t)), or
// t,excitation,displacement (the excitation as it was measured, without its mean, which a table
// cannot have, and without its harmonics above the 8th). t in s, increasing, on even or uneven
// steps. At least 8 points, at least one period, not necessarily a whole number of periods, and
// at least 4 points in a period; otherwise an Error.
// `length_unit`: the model's. Columns whose header states a unit are converted to the model's.
Result<CsvTable> read_run_table(const std::filesystem::path& file, const std::string& length_unit);
Result<estimator::RunData> run_from_table(const CsvTable& table, const std::string& origin,
                                          const Dwell& dwell);

// The displacement of a table: its column y or displacement.
const std::vector<double>& stroke_of(const CsvTable& table);

// The mean of whole periods goes to `run`.
void put_mean_cycle(estimator::MeanCycle mean, estimator::RunData& run);
// The mean of the excitation over cycles of equal numbers of points.
estimator::CycleExcitation mean_excitation_of(const std::vector<record::CycleRow>& rows);
// Whole periods `y` on one grid of n points as Fourier coefficients, weighted by their scatter from
// cycle to cycle. An Error names `origin` where they are too few.
Result<void> put_harmonics(const std::vector<double>& y, std::size_t n, const std::string& origin,
                           estimator::RunData& run);

struct CampaignData {
  std::string name;
  std::string model_json;
  std::vector<estimator::RunData> runs;  // the mean of the accepted cycles of each run
  int cycles = 0;
  std::vector<std::string> warnings;  // about runs that do not repeat as assumed
  bool spoiled = false;               // the mean cycle of one of them is meaningless
};
// Returns an Error when the file is not a campaign database or has no accepted cycle. Runs that
// repeat only after several periods need no accepted cycle: see run_over_periods.hpp.
// `channel_means`: the means of the auxiliary channels are conditions of the runs, which takes as
// long as all samples take to read.
Result<CampaignData> runs_from_database(const std::filesystem::path& file, bool harmonics = false,
                                        const PeriodsOfRuns& periods = {},
                                        bool channel_means = false);

}  // namespace shaker::cli
