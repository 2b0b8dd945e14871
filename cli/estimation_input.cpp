#include "cli/estimation_input.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "base/unit.hpp"
#include "cli/campaign_folder.hpp"
#include "cli/campaign_place.hpp"
#include "cli/run_data.hpp"
#include "cli/run_over_periods.hpp"

namespace shaker::cli {
namespace {

Result<EstimationInput> read_database(const InputOptions& options, const PeriodsOfRuns& periods) {
  if (options.frequency_hz || options.amplitude) {
    return Error{ErrorKind::invalid,
                 "a campaign database knows its frequencies and amplitudes; "
                 "leave --frequency and --amplitude out"};
  }
  auto data = runs_from_database(options.file, options.harmonics, periods);
  if (!data) return data.error();
  auto model = options.model.empty()
                   ? config::parse_model(data->model_json, options.file.string() + " (its model)")
                   : config::load_model(options.model);
  if (!model) return model.error();
  EstimationInput input;
  input.model = std::move(*model);
  input.runs = std::move(data->runs);
  input.campaign = data->name;
  input.warnings = std::move(data->warnings);
  input.spoiled = data->spoiled;
  if (periods.asked()) input.cycles = data->cycles;
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
  input.runs.push_back(std::move(*run));
  auto doubt = doubt_of_repetition(cycles_of(table, dwell.frequency_hz), origin);
  if (!doubt.sentence.empty()) input.warnings.push_back(std::move(doubt.sentence));
  input.spoiled = input.spoiled || doubt.spoils;
  return {};
}

Result<EstimationInput> read_csv_run(const InputOptions& options, const PeriodsOfRuns& periods) {
  if (options.model.empty()) {
    return Error{ErrorKind::invalid,
                 "a CSV file does not say which model; give --model MODEL.json"};
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
  const auto table = read_run_table(options.file, model->length_unit);
  if (!table) return table.error();
  EstimationInput input;
  input.model = std::move(*model);
  const Dwell dwell = {*options.frequency_hz, options.amplitude, options.harmonics};
  if (auto good = add_table(*table, options.file.string(), dwell, periods.all, input); !good)
    return good.error();
  return input;
}

// The runs of a campaign's folder, each with the frequency that campaign.json states.
Result<EstimationInput> read_folder_runs(const InputOptions& options,
                                         const PeriodsOfRuns& periods) {
  if (options.model.empty())
    return Error{ErrorKind::invalid,
                 "a campaign's folder does not say which model; give --model MODEL.json"};
  if (options.frequency_hz || options.amplitude)
    return Error{ErrorKind::invalid,
                 "campaign.json states frequencies and amplitudes; leave --frequency and "
                 "--amplitude out"};
  if (periods.asked())
    return Error{ErrorKind::invalid,
                 "--periods needs a campaign database, or one of the folder's CSV files"};
  auto model = config::load_model(options.model);
  if (!model) return model.error();
  EstimationInput input;
  input.model = std::move(*model);
  auto campaign = read_campaign(options.file, input.model);
  if (!campaign) return campaign.error();
  input.campaign = campaign->name;
  input.warnings = std::move(campaign->warnings);
  for (auto& run : campaign->runs) {
    const std::string origin = fmt::format("{}: run {}", options.file.string(), run.name);
    if (run.kind != estimator::discrepancy::Kind::periodic || run.frequency_hz <= 0.0)
      return Error{ErrorKind::invalid,
                   fmt::format("{} is not periodic, or has no frequency_hz in campaign.json; "
                               "estimate it from its CSV file, with --transient or --frequency",
                               origin)};
    CsvTable table;
    table.columns["t"] = std::move(run.t);
    table.columns[run.excitation.empty() ? "y" : "displacement"] = std::move(run.displacement);
    if (!run.excitation.empty()) table.columns["excitation"] = std::move(run.excitation);
    Dwell dwell = {run.frequency_hz, std::nullopt, options.harmonics};
    if (run.amplitude > 0.0) dwell.amplitude = run.amplitude;
    if (auto good = add_table(table, origin, dwell, 1, input); !good) return good.error();
  }
  return input;
}

bool is_campaign_folder(const std::filesystem::path& path) {
  std::error_code none;
  return std::filesystem::exists(path / "campaign.json", none);
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

Result<EstimationInput> read_estimation_input(const InputOptions& options) {
  const auto periods = parse_periods(options.periods);
  if (!periods) return periods.error();
  const bool folder = is_campaign_folder(options.file);
  if (auto good = folder ? Result<void>() : expect_file(options.file); !good) return good.error();
  auto input = folder                      ? read_folder_runs(options, *periods)
               : is_database(options.file) ? read_database(options, *periods)
                                           : read_csv_run(options, *periods);
  if (!input) return input;
  if (auto good = check_units(input->model); !good) return good.error();
  return input;
}

}  // namespace shaker::cli
