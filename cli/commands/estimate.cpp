// An estimate from a file: a campaign database, or one run as CSV.
#include <stdexcept>

#include <fmt/format.h>

#include "cli/commands.hpp"
#include "cli/run_data.hpp"
#include "config/model.hpp"
#include "estimator/estimation.hpp"
#include "protocol/documents.hpp"
#include "report/estimate_document.hpp"
#include "report/estimate_table.hpp"

namespace shaker::cli {
namespace {

struct Input {
  config::ModelSpec model;
  std::vector<estimator::RunData> runs;
  std::optional<std::string> campaign;
};

bool is_database(const std::filesystem::path& file) {
  const auto extension = file.extension();
  return extension == ".db" || extension == ".sqlite";
}

Result<Input> read_database(const EstimateOptions& options) {
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
  return Input{std::move(*model), std::move(data->runs), data->name};
}

Result<Input> read_csv_run(const EstimateOptions& options) {
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
  Input input;
  input.model = std::move(*model);
  input.runs.push_back(std::move(*run));
  return input;
}

}  // namespace

int estimate(const Common& common, const EstimateOptions& options) {
  auto input = is_database(options.file) ? read_database(options) : read_csv_run(options);
  if (!input) return fail(common, kBadInput, input.error().what);
  try {
    const estimator::Model model(input->model);
    estimator::Estimator estimator(model, std::move(input->runs));
    const estimator::Fit& fit = estimator.fit(model.start());
    if (fit.status == estimator::FitStatus::no_solution) {
      return fail(common, kNotUsable, fit.trouble);
    }
    protocol::EstimateDocument document = report::to_document(estimator.describe());
    document.campaign = input->campaign;
    document.clock = "recorded";
    fmt::print("{}", common.json ? protocol::to_json_text(document) + "\n"
                                 : report::estimate_table(document));
    if (document.usable) return kOk;
    if (!common.json) fmt::print(stderr, "shakerctl: the estimate is not usable\n");
    return kNotUsable;
  } catch (const std::invalid_argument& error) {
    return fail(common, kBadInput, fmt::format("{}: {}", options.file.string(), error.what()));
  }
}

}  // namespace shaker::cli
