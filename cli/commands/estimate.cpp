// An estimate from a file: a campaign database, or one run as CSV.
#include "estimator/estimate.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "cli/periods_of_runs.hpp"
#include "cli/pin_areas.hpp"
#include "cli/posterior_text.hpp"
#include "cli/same_damper.hpp"
#include "cli/values_in_runs.hpp"
#include "estimator/fit/run_comparison.hpp"
#include "estimator/model/run_models.hpp"
#include "protocol/documents.hpp"
#include "report/estimate_document.hpp"
#include "report/estimate_table.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

std::string_view word_of(estimator::FitStatus status) {
  constexpr std::string_view words[] = {"converged", "not converged", "no solution",
                                        "undetermined"};
  return words[static_cast<int>(status)];
}

std::vector<double> free_ones(const std::vector<double>& theta, const estimator::Model& model) {
  std::vector<double> some;
  for (std::size_t k = 0; k < theta.size(); ++k) {
    if (!model.parameters()[k].fixed) some.push_back(theta[k]);
  }
  return some;
}

nlohmann::ordered_json to_json(const estimator::Minima& minima, const estimator::Model& model) {
  auto list = nlohmann::ordered_json::array();
  for (const estimator::Minimum& minimum : minima.found) {
    list.push_back({{"theta", free_ones(minimum.theta, model)},
                    {"sum_of_squares", minimum.sum_of_squares},
                    {"status", word_of(minimum.status)},
                    {"starts", minimum.from.size()}});
  }
  return list;
}

std::string minima_table(const estimator::Minima& minima, const estimator::Model& model) {
  std::vector<std::vector<std::string>> rows = {{"starts", "ended", "sum of squares"}};
  for (const auto& parameter : model.parameters()) {
    if (!parameter.fixed) rows.front().push_back(parameter.name);
  }
  for (const estimator::Minimum& minimum : minima.found) {
    rows.push_back({std::to_string(minimum.from.size()), std::string(word_of(minimum.status)),
                    fmt::format("{:.6g}", minimum.sum_of_squares)});
    for (const double value : free_ones(minimum.theta, model))
      rows.back().push_back(fmt::format("{:.5g}", value));
  }
  return fmt::format("\nWhere the starts ended ({} of {} points looked at had a solution):\n\n{}",
                     minima.admissible, minima.looks,
                     report::text_table(rows, std::vector<bool>(rows.front().size(), true)));
}

// True for channels that are weighted against each other; estimate_channels fits them.
bool wants_channels(const EstimateOptions& options) {
  return options.channels != std::vector<std::string>{"displacement"} ||
         options.objective == "maximum_likelihood" || options.objective == "joint_covariance" ||
         options.stagewise;
}

void forget_priors(config::ModelSpec& model) {
  for (config::EffectSpec& effect : model.effects) {
    for (auto& [name, parameter] : effect.parameters)
      parameter.prior_mean = parameter.prior_standard_deviation = std::nullopt;
  }
}

bool has_priors(const config::ModelSpec& model) {
  for (const config::EffectSpec& effect : model.effects) {
    for (const auto& [name, parameter] : effect.parameters) {
      if (parameter.prior_mean) return true;
    }
  }
  return false;
}

// True for losses and intervals that already account for the curvature of the model.
bool follows_the_bend(const EstimateOptions& options) {
  return options.loss != "squared" || options.intervals != "linear";
}

estimator::Bias bias_rule(const EstimateOptions& options) {
  return follows_the_bend(options) ? estimator::Bias::off
                                   : *estimator::bias_from_name(options.bias);
}

// Applies --objective to the model and the data, and the other options. An Error says what the
// objective lacks.
Result<estimator::RunsEstimateOptions> how_to_estimate(const EstimateOptions& options,
                                                       EstimationInput& input) {
  estimator::RunsEstimateOptions how;
  if (!options.noise.empty() && options.noise.size() != 1)
    return Error{
        ErrorKind::invalid,
        fmt::format("{} standard deviations with --noise for one channel", options.noise.size())};
  if (!options.noise.empty()) how.fit.noise = options.noise.front();
  how.accuracy = options.accuracy;
  how.starts = options.starts;
  how.seed = options.seed;
  how.loss = *estimator::loss_from_name(options.loss);
  how.bias = bias_rule(options);
  how.posterior = options.intervals == "posterior";
  if (!how.posterior) how.intervals = *estimator::interval_kind_from_name(options.intervals);
  if (options.objective == "map" && !has_priors(input.model))
    return Error{ErrorKind::invalid,
                 "the model has no prior, so there is no posterior to maximise: give a parameter "
                 "\"prior_mean\" and \"prior_standard_deviation\" in the model file"};
  if (options.objective == "least_squares" || options.objective == "weighted")
    forget_priors(input.model);
  if (options.objective == "weighted" && options.noise.empty()) {
    if (const auto run = estimator::weigh_by_scatter(input.runs))
      return Error{ErrorKind::invalid,
                   fmt::format("run {}: the cycles do not show how large its noise is; say it with "
                               "--noise, or choose another objective",
                               *run + 1)};
  }
  return how;
}

// Returns a sentence for an option that cannot be combined with --periods; otherwise empty.
std::string not_over_periods(const EstimateOptions& options) {
  const auto periods = parse_periods(options.periods);
  if (!periods || !periods->asked()) return {};
  if (wants_channels(options)) return "--periods knows the displacement alone";
  if (options.objective == "harmonics")
    return "Fourier coefficients are those of one period; leave --periods or --objective harmonics "
           "out";
  if (options.starts > 1)
    return "--starts looks for responses of one period; with --periods the records themselves lead "
           "to a start: leave --starts out";
  if (options.intervals == "posterior")
    return "the posterior of responses over several periods cannot be sampled; choose other "
           "--intervals";
  return {};
}

// Puts the warnings about the data before those of the fit.
void add_input(estimator::Estimate& estimate, const EstimationInput& input) {
  estimate.warnings.insert(estimate.warnings.begin(), input.warnings.begin(), input.warnings.end());
  if (input.cycles) estimate.cycles = *input.cycles;
  estimate.usable = estimate.usable && !input.spoiled;
}

// The objective that was minimised, also when it was chosen by default.
std::string objective_name(const EstimateOptions& options, const config::ModelSpec& model) {
  if (!options.objective.empty()) return options.objective;
  return has_priors(model) ? "map" : "least_squares";
}

// Why these options do not go together; empty if they do.
std::string contradiction(const EstimateOptions& options) {
  if (auto why = not_over_periods(options); !why.empty()) return why;
  if (wants_channels(options)) {
    if (options.accuracy > 0.0)
      return "--accuracy refines the fit of the displacement alone; leave it or the choice of "
             "channels out";
    if (options.bias == "always") return "--bias always knows the displacement alone";
    return "";
  }
  if (options.loss != "squared" && options.intervals != "linear")
    return fmt::format("{} intervals belong to the squared loss; leave --loss or --intervals out",
                       options.intervals);
  if (options.bias == "always" && follows_the_bend(options))
    return "--bias always belongs to the squared loss and linear intervals; the others follow the "
           "model's bend by themselves";
  if (options.objective == "harmonics" && (options.loss != "squared" || options.starts > 1))
    return "Fourier coefficients go without --loss and --starts";
  return "";
}

nlohmann::ordered_json grid_json(const estimator::RunsEstimate::Grid& grid) {
  nlohmann::ordered_json json = {{"points", grid.points}, {"reached", grid.reached}};
  if (std::isfinite(grid.error)) json["error"] = grid.error;
  return json;
}

void print_json(const protocol::EstimateDocument& document, const EstimateOptions& options,
                const EstimationInput& input, const estimator::RunsEstimate& found) {
  auto json = nlohmann::ordered_json::parse(protocol::to_json_text(document));
  if (found.searched) json["minima"] = to_json(*found.searched, *found.model);
  if (found.grid) json["grid"] = grid_json(*found.grid);
  json["objective"] = objective_name(options, input.model);
  json["intervals"] = options.intervals;
  json["loss"] = options.loss;
  json["bias"] = estimator::name(bias_rule(options));
  if (found.sampled) {
    json["posterior"] = posterior_json(*found.sampled, document.covariance_order);
    json["posterior_sampling"] = sampling_of(*found.sampled);
  }
  if (!found.in_runs.empty()) json["in_runs"] = in_runs_json(found.in_runs);
  if (!found.pin.empty()) json["pin_table"] = pin_areas_json(found.pin);
  fmt::print("{}\n", json.dump());
}

void print_text(const protocol::EstimateDocument& document, const estimator::RunsEstimate& found) {
  fmt::print("{}", report::estimate_table(document));
  fmt::print("{}", in_runs_table(found.in_runs));
  fmt::print("{}", pin_areas_text(found.pin, found.model->length_unit()));
  if (found.grid) fmt::print("{}\n", found.grid->sentence);
  if (found.sampled) fmt::print("{}", posterior_table(*found.sampled, document.covariance_order));
  if (found.searched) fmt::print("{}", minima_table(*found.searched, *found.model));
}

}  // namespace

int estimate(const Common& common, const EstimateOptions& options) {
  if (auto why = contradiction(options); !why.empty()) return fail(common, kBadInput, why);
  if (wants_channels(options)) return estimate_channels(common, options);
  if (holds_records(options)) return estimate_records(common, options);
  InputOptions reading = options;
  reading.harmonics = options.objective == "harmonics";
  auto input = read_estimation_input(reading);
  if (!input) return fail(common, kBadInput, input.error().what);
  const bool varies = estimator::varies_by_run(input->model);
  if (auto apart = varies ? std::nullopt : disagreement(reading))
    input->warnings.insert(input->warnings.begin(), *apart);
  const auto how = how_to_estimate(options, *input);
  if (!how) return fail(common, kBadInput, how.error().what);
  try {
    auto found = estimator::estimate(input->model, input->runs, *how);
    if (!found)
      return fail(common, found.error().kind == ErrorKind::invalid ? kBadInput : kNotUsable,
                  found.error().what);
    add_input(found->estimate, *input);
    protocol::EstimateDocument document = report::to_document(found->estimate);
    document.campaign = input->campaign;
    document.clock = "recorded";
    if (common.json)
      print_json(document, options, *input, *found);
    else
      print_text(document, *found);
    if (document.usable) return document.intervals_hold ? kOk : kIntervals;
    if (!common.json) fmt::print(stderr, "shakerctl: the estimate is not usable\n");
    return kNotUsable;
  } catch (const std::invalid_argument& error) {
    return fail(common, kBadInput, fmt::format("{}: {}", options.names(), error.what()));
  }
}

}  // namespace shaker::cli
