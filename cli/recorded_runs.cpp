#include "cli/recorded_runs.hpp"

#include <utility>

#include <fmt/format.h>

#include "cli/repetition.hpp"
#include "cli/run_data.hpp"
#include "cli/run_over_periods.hpp"
#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/cycles/record_checks.hpp"
#include "estimator/diagnosis/cycles/steady_cycles.hpp"

namespace shaker::cli {
namespace {

using estimator::RunData;
namespace diagnosis = estimator::diagnosis;

constexpr int kDriverPoints = 64;

std::vector<double> curve_of(const Eigen::VectorXd& harmonics, int points) {
  const Eigen::VectorXd curve = diagnosis::synthesised(harmonics, points);
  return {curve.data(), curve.data() + curve.size()};
}

// Of the mean excitation's harmonics, the mean left out.
double driver_error(const Eigen::MatrixXd& rows) {
  std::vector<double> harmonics;
  for (const auto& row : rows.rowwise())
    harmonics.insert(harmonics.end(), row.begin() + 1, row.end());
  const auto count = static_cast<std::size_t>(rows.cols() - 1);
  return count > 0 ? estimator::mean_cycle(harmonics, count).standard_error() : 0.0;
}

Result<RunData> run_of(const diagnosis::SteadyRun& steady, const std::string& origin,
                       bool harmonics) {
  RunData run;
  run.frequency_hz = steady.frequency_hz;
  run.excitation = curve_of(steady.mean_driver(), kDriverPoints);
  if (steady.driver_measured) run.excitation_error = driver_error(steady.driver);
  const auto points = static_cast<std::size_t>(steady.response.cols());
  std::vector<double> cycles;
  for (Eigen::Index k = 0; k < steady.response.rows(); ++k) {
    const auto one = curve_of(steady.response.row(k).transpose(), static_cast<int>(points));
    cycles.insert(cycles.end(), one.begin(), one.end());
  }
  put_mean_cycle(estimator::mean_cycle(cycles, points), run);
  if (harmonics) {
    if (auto good = put_harmonics(cycles, points, origin, run); !good) return good.error();
  }
  return run;
}

config::RunCondition condition_of(const diagnosis::Recording& recording) {
  config::RunCondition condition = recording.condition;
  condition.run = recording.name;
  return condition;
}

// All samples, where no cycles are found steady: too few, or put together by another program. An
// Error where they do not repeat.
Result<RunData> run_of_all_samples(const diagnosis::Recording& recording, const std::string& origin,
                                   bool harmonics) {
  CsvTable table;
  table.columns["t"] = recording.t;
  table.columns[recording.excitation.empty() ? "y" : "displacement"] = recording.displacement;
  if (!recording.excitation.empty()) table.columns["excitation"] = recording.excitation;
  Dwell dwell = {recording.frequency_hz, std::nullopt, harmonics};
  if (recording.amplitude > 0.0) dwell.amplitude = recording.amplitude;
  auto run = run_from_table(table, origin, dwell);
  if (!run) return run;
  auto doubt = doubt_of_repetition(cycles_of(table, dwell.frequency_hz), origin);
  if (doubt.spoils) return Error{ErrorKind::invalid, std::move(doubt.sentence)};
  return run;
}

}  // namespace

Result<std::vector<RunData>> runs_of_recordings(const diagnosis::Campaign& campaign,
                                                const std::string& place, bool harmonics,
                                                std::vector<std::string>& warnings) {
  std::vector<RunData> runs;
  std::string trouble;  // of the first run that cannot be used
  for (const diagnosis::Recording& recording : campaign.runs) {
    const std::string origin = fmt::format("{}: run {}", place, recording.name);
    if (recording.kind != diagnosis::Kind::periodic)
      return Error{ErrorKind::invalid,
                   origin +
                       " is not a periodic response; `shakerctl diagnose` reads such runs, or "
                       "give its CSV file with --transient"};
    if (recording.role == diagnosis::Role::held_out) {
      warnings.push_back(
          fmt::format("run {} is held out by the campaign's file and not fitted", recording.name));
      continue;
    }
    auto steady = diagnosis::steady_cycles(recording);
    if (!steady) {
      const Error& why = steady.error();
      auto run = run_of_all_samples(recording, origin, harmonics);
      if (!run && why.kind == ErrorKind::invalid) return Error{why.kind, place + ": " + why.what};
      if (!run || why.what.find(diagnosis::kClipped) != std::string::npos) {
        if (trouble.empty()) trouble = why.what;
        warnings.push_back(why.what + " (this run is left out)");
        continue;
      }
      warnings.push_back(why.what + "; all its samples are taken as they are");
      run->condition = condition_of(recording);
      runs.push_back(std::move(*run));
      continue;
    }
    warnings.insert(warnings.end(), steady->warnings.begin(), steady->warnings.end());
    auto run = run_of(*steady, origin, harmonics);
    if (!run) return run.error();
    run->condition = condition_of(recording);
    runs.push_back(std::move(*run));
  }
  if (runs.empty() && !trouble.empty())
    return Error{ErrorKind::not_converged, place + ": no run can be used: " + trouble};
  if (runs.empty())
    return Error{ErrorKind::invalid,
                 place + ": every run is held out; at least one must have the role \"fit\""};
  return runs;
}

}  // namespace shaker::cli
