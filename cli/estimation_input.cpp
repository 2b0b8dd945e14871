#include "cli/estimation_input.hpp"

#include <utility>

#include "cli/run_data.hpp"

namespace shaker::cli {
namespace {

bool is_database(const std::filesystem::path& file) {
  const auto extension = file.extension();
  return extension == ".db" || extension == ".sqlite";
}

Result<EstimationInput> read_database(const InputOptions& options) {
  if (options.frequency_hz || options.amplitude) {
    return Error{ErrorKind::invalid,
                 "a campaign database knows its frequencies and amplitudes; "
                 "leave --frequency and --amplitude out"};
  }
  auto data = runs_from_database(options.file);
  if (!data) return data.error();
  auto model = options.model.empty()
                   ? config::parse_model(data->model_json, options.file.string() + " (its model)")
                   : config::load_model(options.model);
  if (!model) return model.error();
  return EstimationInput{std::move(*model), std::move(data->runs), data->name};
}

Result<EstimationInput> read_csv_run(const InputOptions& options) {
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
  auto run = run_from_csv(options.file, {*options.frequency_hz, options.amplitude});
  if (!run) return run.error();
  EstimationInput input;
  input.model = std::move(*model);
  input.runs.push_back(std::move(*run));
  return input;
}

}  // namespace

Result<EstimationInput> read_estimation_input(const InputOptions& options) {
  return is_database(options.file) ? read_database(options) : read_csv_run(options);
}

}  // namespace shaker::cli
