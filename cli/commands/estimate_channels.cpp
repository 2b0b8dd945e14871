// Estimates from several measured channels and weights each by its noise.
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/channel_data.hpp"
#include "cli/commands.hpp"
#include "cli/values_in_runs.hpp"
#include "estimator/fit/description.hpp"
#include "estimator/model/run_models.hpp"
#include "protocol/documents.hpp"
#include "report/estimate_document.hpp"
#include "report/estimate_table.hpp"

namespace shaker::cli {
namespace {

using OrderedJson = nlohmann::ordered_json;

// The covariance of the channels' noise: from --noise (3.15), otherwise variance 1 for all
// (3.17); the other objectives estimate it.
std::vector<double> known_covariance(const EstimateOptions& options, const ChannelInput& input) {
  const std::size_t m = input.quantities.size();
  std::vector<double> v(m * m, 0.0);
  for (std::size_t b = 0; b < m; ++b) {
    const double sigma = options.noise.empty() ? 1.0 : options.noise[b] / input.scale[b];
    v[b * m + b] = sigma * sigma;
  }
  return v;
}

// The noise of each channel in the file's units, and the correlation between channels.
OrderedJson noise_of(const EstimateOptions& options, const ChannelInput& input,
                     const estimator::ChannelFit& found, OrderedJson& correlation) {
  const std::size_t m = input.quantities.size();
  OrderedJson channels = OrderedJson::array();
  correlation = OrderedJson::array();
  for (std::size_t a = 0; a < m; ++a) {
    const double sigma = std::sqrt(found.noise_covariance[a * m + a]);
    channels.push_back({{"name", options.channels[a]},
                        {"unit", input.units[a]},
                        {"noise_standard_deviation", sigma * input.scale[a]}});
    OrderedJson row = OrderedJson::array();
    for (std::size_t b = 0; b < m; ++b)
      row.push_back(a == b ? 1.0
                           : found.noise_covariance[a * m + b] /
                                 (sigma * std::sqrt(found.noise_covariance[b * m + b])));
    correlation.push_back(std::move(row));
  }
  return channels;
}

void print(const protocol::EstimateDocument& document, const OrderedJson& channels,
           const OrderedJson& correlation) {
  fmt::print("{}\nNoise of the channels:\n", report::estimate_table(document));
  for (std::size_t a = 0; a < channels.size(); ++a) {
    fmt::print("  {:<14}{:.4g} {}", channels[a]["name"].get<std::string>(),
               channels[a]["noise_standard_deviation"].get<double>(),
               channels[a]["unit"].get<std::string>());
    for (std::size_t b = 0; b < a; ++b)
      fmt::print("{} {:+.2f} with {}", b == 0 ? ", correlation" : ",",
                 correlation[a][b].get<double>(), channels[b]["name"].get<std::string>());
    fmt::print("\n");
  }
}

// Why these options do not go together; empty if they do.
std::string contradiction_of_channels(const EstimateOptions& options) {
  if (options.intervals != "linear" || options.loss != "squared" || options.starts > 1)
    return "--intervals, --loss and --starts are for one channel and least squares; leave them out "
           "with several channels or a maximum-likelihood objective";
  if (options.objective.empty() || options.objective == "harmonics" || options.objective == "map")
    return "several channels need an objective that weighs them: --objective maximum_likelihood, "
           "joint_covariance, or weighted with --noise";
  if (options.objective == "least_squares" && options.channels.size() > 1)
    return "unweighted least squares cannot add up metres and newtons; choose --objective "
           "maximum_likelihood, joint_covariance, or weighted with --noise";
  if (options.objective != "weighted")
    return options.noise.empty() ? ""
                                 : "with this objective the noise is estimated; leave --noise out";
  if (options.noise.size() == options.channels.size()) return "";
  return fmt::format(
      "{} channels and {} standard deviations; --objective weighted wants one for each with "
      "--noise",
      options.channels.size(), options.noise.size());
}

// Gives each run its own model where parameters differ from run to run. Where a run lacks what that
// needs, there is one model for all, and `warning` says so.
estimator::RunModels give_models(const config::ModelSpec& spec,
                                 const std::vector<config::RunCondition>& conditions,
                                 std::vector<estimator::ChannelRun>& runs, std::string& warning) {
  const std::string lacks = estimator::lacking_condition(spec, conditions);
  if (!lacks.empty())
    warning = estimator::taken_as_one(spec, "an estimate of channels") + ": " + lacks;
  if (!lacks.empty() || !estimator::varies_by_run(spec))
    return {{std::make_shared<const estimator::Model>(spec)}, {}};
  auto models = estimator::run_models(spec, conditions);
  for (std::size_t r = 0; r < runs.size(); ++r)
    runs[r].model = models->of_run[r];
  return std::move(*models);
}

}  // namespace

int estimate_channels(const Common& common, const EstimateOptions& options) {
  if (auto why = contradiction_of_channels(options); !why.empty())
    return fail(common, kBadInput, why);
  auto input = read_channels(options, options.channels, options.mass);
  if (!input) return fail(common, kBadInput, input.error().what);
  try {
    for (config::EffectSpec& effect : input->model.effects) {
      for (auto& [name, parameter] : effect.parameters)
        parameter.prior_mean = parameter.prior_standard_deviation = std::nullopt;
    }
    std::string as_one;
    std::vector<config::RunCondition> conditions;
    for (const estimator::ChannelRun& run : input->runs)
      conditions.push_back(run.condition);
    const auto models = give_models(input->model, conditions, input->runs, as_one);
    const estimator::Model& model = models.joint();
    estimator::ChannelOptions how;
    how.stagewise = options.stagewise;
    how.noise = options.objective == "weighted"           ? estimator::NoiseModel::known
                : options.objective == "joint_covariance" ? estimator::NoiseModel::joint
                                                          : estimator::NoiseModel::independent;
    how.known_covariance = known_covariance(options, *input);
    double cycles = 0.0;
    for (const estimator::ChannelRun& run : input->runs)
      cycles += run.cycles;
    const std::size_t runs = input->runs.size();
    const estimator::ChannelFit found =
        fit_channels(model, input->quantities, std::move(input->runs), model.start(), how);
    if (found.fit.status == estimator::FitStatus::no_solution)
      return fail(common, kNotUsable, found.fit.trouble);
    estimator::Estimate estimate = estimator::describe(model, found.fit);
    estimate.runs = static_cast<int>(runs);
    estimate.cycles = std::lround(cycles);
    if (!as_one.empty()) estimate.warnings.push_back(std::move(as_one));
    protocol::EstimateDocument document = report::to_document(estimate);
    document.campaign = input->campaign;
    document.clock = "recorded";
    const auto in_runs = estimator::values_in_runs(models, conditions, estimate);
    OrderedJson correlation;
    const OrderedJson channels = noise_of(options, *input, found, correlation);
    if (common.json) {
      auto json = OrderedJson::parse(protocol::to_json_text(document));
      json["objective"] = options.objective;
      json["channels"] = channels;
      json["noise_correlation"] = correlation;
      json["log_likelihood"] = found.log_likelihood;
      if (!in_runs.empty()) json["in_runs"] = in_runs_json(in_runs);
      fmt::print("{}\n", json.dump());
    } else {
      print(document, channels, correlation);
      fmt::print("{}", in_runs_table(in_runs));
    }
    if (document.usable) return kOk;
    if (!common.json) fmt::print(stderr, "shakerctl: the estimate is not usable\n");
    return kNotUsable;
  } catch (const std::invalid_argument& error) {
    return fail(common, kBadInput, fmt::format("{}: {}", options.file().string(), error.what()));
  }
}

}  // namespace shaker::cli
