#include "cli/drop_knowledge.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>

#include <Eigen/Core>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/documents_in.hpp"
#include "cli/estimation_input.hpp"
#include "cli/opened_campaign.hpp"
#include "config/model.hpp"
#include "estimator/estimate.hpp"
#include "estimator/model/mean_of_runs.hpp"
#include "report/estimate_document.hpp"

namespace shaker::cli {
namespace {

Result<protocol::EstimateDocument> read_estimate(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) return Error{ErrorKind::io, fmt::format("{}: cannot be read", file.string())};
  const auto json = nlohmann::json::parse(in, nullptr, false);
  if (!json.is_object() || !json.contains("parameters"))
    return Error{ErrorKind::invalid,
                 fmt::format("{}: is no estimate; give what `shakerctl estimate --json` prints",
                             file.string())};
  auto estimate = estimate_from(json);
  estimate.covariance_order.clear();
  estimate.covariance.clear();
  for (const auto& name : json.value("covariance_order", nlohmann::json::array()))
    estimate.covariance_order.push_back(name.is_string() ? name.get<std::string>() : "");
  for (const auto& row : json.value("covariance", nlohmann::json::array())) {
    for (const auto& number : row)
      estimate.covariance.push_back(number.is_number() ? number.get<double>()
                                                       : std::numeric_limits<double>::quiet_NaN());
  }
  return estimate;
}

// What is known before the estimate is put into the model.
struct KnownBefore {
  config::ModelSpec spec;
  protocol::EstimateDocument estimate;  // empty parameters: the model's start values
};

Result<KnownBefore> fitted_now(const DropOptions& options, DropKnowledge& out) {
  InputOptions reading;
  reading.files = {options.campaign};
  reading.model = options.model;
  if (auto good = expect_campaign(options.campaign); !good) return good.error();
  auto data = read_estimation_input(reading);
  if (!data) return data.error();
  KnownBefore known;
  known.spec = std::move(data->model);
  const auto found = estimator::estimate(known.spec, std::move(data->runs));
  if (!found) return found.error();
  out.fastest = found->fastest;
  out.deepest = found->deepest;
  known.estimate = report::to_document(found->estimate);
  return known;
}

Result<KnownBefore> known_before(const DropOptions& options, DropKnowledge& out) {
  if (!options.campaign.empty()) return fitted_now(options, out);
  if (options.model.empty())
    return Error{
        ErrorKind::invalid,
        "what falls? give a CAMPAIGN (with --diagnosis FOLDER where there is one), or --model "
        "MODEL.json with or without --estimate ESTIMATE.json"};
  auto spec = config::load_model(options.model);
  if (!spec) return spec.error();
  KnownBefore known;
  known.spec = std::move(*spec);
  if (!options.estimate.empty()) {
    auto estimate = read_estimate(options.estimate);
    if (!estimate) return estimate.error();
    known.estimate = std::move(*estimate);
  }
  out.fastest = options.identified_speed;
  out.deepest = options.identified_stroke;
  return known;
}

// A parameter of an estimate at its place in the model file: theta2[r01] is theta2 in one run.
std::optional<estimator::ModelNumber> number_called(const std::string& name,
                                                    const estimator::Model& model) {
  const auto& parameters = model.parameters();
  const auto called = [&](const std::string& what) {
    return std::find_if(parameters.begin(), parameters.end(),
                        [&](const auto& parameter) { return parameter.name == what; });
  };
  auto found = called(name);
  if (found == parameters.end()) found = called(name.substr(0, name.rfind('[')));
  if (found == parameters.end()) return std::nullopt;
  return estimator::numbers_of(model)[static_cast<std::size_t>(found - parameters.begin())];
}

// Sets the model's numbers to the estimate's values.
void take_values(const protocol::EstimateDocument& estimate, const estimator::Model& model,
                 config::ModelSpec& spec) {
  std::vector<estimator::ModelNumber> places;
  std::vector<double> values;
  for (const auto& entry : estimate.parameters) {
    const auto place = number_called(entry.name, model);
    if (!place) continue;
    places.push_back(*place);
    values.push_back(entry.value);
  }
  const auto mean = estimator::mean_of_runs(places, values);
  for (std::size_t n = 0; n < mean.numbers.size(); ++n)
    estimator::set_value(spec, mean.numbers[n], mean.values[n]);
  const auto all = estimator::numbers_of(model);
  for (std::size_t k = 0; k < all.size(); ++k) {
    const bool met = std::any_of(places.begin(), places.end(), [&](const auto& place) {
      return place.line == all[k].line && place.symbol == all[k].symbol;
    });
    if (!met)
      throw std::invalid_argument(
          fmt::format("the estimate has no parameter {}; is it one of model '{}'?",
                      model.parameters()[k].name, model.name()));
  }
}

// Takes the covariance of the numbers that the model has, where all of it are numbers.
void take_covariance(const protocol::EstimateDocument& estimate, const estimator::Model& model,
                     DropKnowledge& out) {
  std::vector<estimator::ModelNumber> places;
  std::vector<double> values;
  std::vector<Eigen::Index> rows;
  for (std::size_t i = 0; i < estimate.covariance_order.size(); ++i) {
    const std::string& name = estimate.covariance_order[i];
    const auto place = number_called(name, model);
    if (!place) continue;
    const auto entry = std::find_if(estimate.parameters.begin(), estimate.parameters.end(),
                                    [&](const auto& p) { return p.name == name; });
    if (entry == estimate.parameters.end()) continue;
    places.push_back(*place);
    values.push_back(entry->value);
    rows.push_back(static_cast<Eigen::Index>(i));
  }
  estimator::DamperHypothesis& h = out.hypothesis;
  h.degrees_of_freedom = static_cast<double>(estimate.degrees_of_freedom);
  const auto size = static_cast<Eigen::Index>(estimate.covariance_order.size());
  if (!rows.empty() && std::ssize(estimate.covariance) == size * size && h.degrees_of_freedom > 0) {
    const Eigen::Map<const Eigen::MatrixXd> all(estimate.covariance.data(), size, size);
    const auto mean = estimator::mean_of_runs(places, values);
    const Eigen::MatrixXd v = mean.covariance(all(rows, rows));
    if (v.allFinite()) {
      h.numbers = mean.numbers;
      h.covariance.assign(v.data(), v.data() + v.size());
    }
  }
  if (h.covariance.empty())
    out.warnings.push_back(
        "the estimate has no covariance (parameters that its data do not determine): no band");
  if (!estimate.usable) out.warnings.push_back("the estimate says of itself that it is not usable");
}

// Puts the estimate's values into the model and its covariance beside it. Names that the model does
// not have (initial states of a transient estimate) are left out.
void take_estimate(const KnownBefore& known, DropKnowledge& out) {
  estimator::DamperHypothesis& h = out.hypothesis;
  h.model = known.spec;
  h.probability = 1.0;
  if (known.estimate.parameters.empty()) {
    out.warnings.push_back(
        "no estimate was given: these are the model file's start values, and there is no band");
    return;
  }
  const estimator::Model model(known.spec);
  take_values(known.estimate, model, h.model);
  take_covariance(known.estimate, model, out);
}

}  // namespace

Result<DropKnowledge> drop_knowledge(const DropOptions& options) {
  DropKnowledge out;
  const auto known = known_before(options, out);
  if (!known) return known.error();
  take_estimate(*known, out);
  out.hypothesis = estimator::without_instruments(out.hypothesis);
  return out;
}

}  // namespace shaker::cli
