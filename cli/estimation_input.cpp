#include "cli/estimation_input.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "base/unit.hpp"
#include "cli/campaign_folder.hpp"
#include "cli/opened_campaign.hpp"
#include "cli/recorded_runs.hpp"
#include "cli/run_data.hpp"
#include "cli/run_over_periods.hpp"
#include "estimator/model/run_models.hpp"

namespace shaker::cli {
namespace {

// Runs of one name in two campaigns are told apart by the campaign's.
Result<void> add_runs(std::vector<estimator::RunData> runs, const std::filesystem::path& place,
                      EstimationInput& input) {
  const std::size_t before = input.runs.size();
  for (estimator::RunData& run : runs) {
    std::string& name = run.condition.run;
    for (std::size_t r = 0; r < before; ++r) {
      const estimator::RunData& other = input.runs[r];
      if (run.displacement == other.displacement && run.harmonics == other.harmonics)
        return held_twice(place, name, other.condition.run);
    }
    const bool taken =
        std::any_of(input.runs.begin(), input.runs.begin() + static_cast<std::ptrdiff_t>(before),
                    [&](const auto& other) { return other.condition.run == name; });
    if (taken) name = fmt::format("{}/{}", place.stem().string(), name);
    input.runs.push_back(std::move(run));
  }
  return {};
}

// Adds the runs of one database.
Result<void> add_database(const std::filesystem::path& file, const InputOptions& options,
                          const PeriodsOfRuns& periods, EstimationInput& input) {
  auto data =
      runs_from_database(file, options.harmonics, periods, estimator::varies_by_run(input.model));
  if (!data) return data.error();
  if (auto added = add_runs(std::move(data->runs), file, input); !added) return added;
  input.warnings.insert(input.warnings.end(), data->warnings.begin(), data->warnings.end());
  input.spoiled = input.spoiled || data->spoiled;
  if (periods.asked()) input.cycles = input.cycles.value_or(0) + data->cycles;
  input.campaign = input.campaign ? *input.campaign + " + " + data->name : data->name;
  return {};
}

// Adds the runs of one folder, in the units of the input's model.
Result<void> add_folder(const std::filesystem::path& folder, const InputOptions& options,
                        const PeriodsOfRuns& periods, EstimationInput& input) {
  if (periods.asked())
    return Error{ErrorKind::invalid,
                 folder.string() +
                     ": is a folder, whose runs are cut into single periods; give a "
                     "database or a CSV file with --periods"};
  const auto campaign = read_campaign(folder, input.model);
  if (!campaign) return campaign.error();
  input.warnings.insert(input.warnings.end(), campaign->warnings.begin(), campaign->warnings.end());
  auto runs = runs_of_recordings(*campaign, folder.string(), options.harmonics, input.warnings);
  if (!runs) return runs.error();
  if (auto added = add_runs(std::move(*runs), folder, input); !added) return added;
  input.campaign = input.campaign ? *input.campaign + " + " + campaign->name : campaign->name;
  return {};
}

Result<EstimationInput> read_campaigns(const InputOptions& options, const PeriodsOfRuns& periods) {
  if (options.frequency_hz || options.amplitude)
    return Error{ErrorKind::invalid,
                 "a campaign knows its frequencies and amplitudes; "
                 "leave --frequency and --amplitude out"};
  for (const auto& place : options.files) {
    if (auto good = expect_campaign(place); !good) return good.error();
  }
  auto model = model_of_campaigns(options.files, options.model);
  if (!model) return model.error();
  EstimationInput input;
  input.model = std::move(*model);
  for (const auto& place : options.files) {
    auto added = place_of(place) == Place::database ? add_database(place, options, periods, input)
                                                    : add_folder(place, options, periods, input);
    if (!added) return added.error();
  }
  return input;
}

// Adds the run of a table: its mean cycle, or the mean of groups of cycles.
Result<void> add_table(const CsvTable& table, const std::string& origin, const Dwell& dwell,
                       int periods, EstimationInput& input) {
  if (periods > 1) {
    auto run = run_over_periods(table, origin, dwell, periods);
    if (!run) return run.error();
    input.cycles = run->cycles;
    input.runs.push_back(std::move(run->data));
    return {};
  }
  auto run = run_from_table(table, origin, dwell);
  if (!run) return run.error();
  run->condition.run = "1";
  input.runs.push_back(std::move(*run));
  auto doubt = doubt_of_repetition(cycles_of(table, dwell.frequency_hz), origin);
  if (!doubt.sentence.empty()) input.warnings.push_back(std::move(doubt.sentence));
  input.spoiled = input.spoiled || doubt.spoils;
  return {};
}

Result<EstimationInput> read_csv_run(const InputOptions& options, const PeriodsOfRuns& periods) {
  if (options.model.empty()) {
    return Error{ErrorKind::invalid,
                 fmt::format("{}: is neither a campaign database (.db) nor a campaign's folder; "
                             "a CSV file does not say which model: give --model MODEL.json",
                             options.files.empty() ? "" : options.files.front().string())};
  }
  if (!options.frequency_hz) {
    return Error{ErrorKind::invalid,
                 "a CSV file does not say its frequency; give --frequency in Hz"};
  }
  auto model = config::load_model(options.model);
  if (!model) return model.error();
  if (!periods.named.empty())
    return Error{ErrorKind::invalid,
                 "a CSV file is one run and has no name for it; say --periods M"};
  const auto table = read_run_table(options.file(), model->length_unit);
  if (!table) return table.error();
  EstimationInput input;
  input.model = std::move(*model);
  const Dwell dwell = {*options.frequency_hz, options.amplitude, options.harmonics};
  if (auto good = add_table(*table, options.file().string(), dwell, periods.all, input); !good)
    return good.error();
  return input;
}

}  // namespace

// A model with lengths in feet and gravity in metres fits nothing, and no other check finds it.
// The model's own units are not checked.
Result<void> check_units(const config::ModelSpec& model) {
  constexpr double kGravity = 9.80665, kShare = 0.02;
  const auto differs = [&](const Unit& unit) {
    return std::fabs(model.gravity * unit.scale / kGravity - 1.0) > kShare;
  };
  const bool weighs = std::any_of(model.effects.begin(), model.effects.end(),
                                  [](const auto& effect) { return effect.effect == "gravity"; });
  const auto own = unit_called(model.length_unit, Dimension::length);
  if (!weighs || !own || !differs(*own)) return {};
  for (const Unit& unit : units_with(Dimension::length)) {
    if (differs(unit)) continue;
    return Error{
        ErrorKind::invalid,
        fmt::format("the model \"{}\" counts lengths in {} and has a gravity of {:g} "
                    "{}/s^2, which is that of {}/s^2: \"length_unit\" and \"gravity\" do "
                    "not match",
                    model.name, model.length_unit, model.gravity, model.length_unit, unit.name)};
  }
  return {};
}

std::string InputOptions::names() const {
  std::string all;
  for (const auto& file : files)
    all += (all.empty() ? "" : ", ") + file.string();
  return all;
}

Result<EstimationInput> read_estimation_input(const InputOptions& options) {
  const auto periods = parse_periods(options.periods);
  if (!periods) return periods.error();
  std::error_code none;
  const bool one_file = options.files.size() == 1 && place_of(options.file()) == Place::other &&
                        !std::filesystem::is_directory(options.file(), none);
  auto input = one_file ? read_csv_run(options, *periods) : read_campaigns(options, *periods);
  if (!input) return input;
  if (auto good = check_units(input->model); !good) return good.error();
  return input;
}

}  // namespace shaker::cli
