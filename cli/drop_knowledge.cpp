#include "cli/drop_knowledge.hpp"

#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/documents_in.hpp"
#include "cli/estimation_input.hpp"
#include "cli/opened_campaign.hpp"
#include "config/model.hpp"
#include "estimator/fit/run_comparison.hpp"
#include "estimator/inference/second_order.hpp"
#include "estimator/model/run_models.hpp"
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
  if (auto why = estimator::taken_as_one(known.spec, "a drop without a diagnosis"); !why.empty())
    out.warnings.push_back(std::move(why));
  const estimator::Model model(known.spec);
  estimator::Estimator fitted(model, std::move(data->runs));
  const auto& fit = fitted.fit(model.start());
  if (fit.status == estimator::FitStatus::no_solution)
    return Error{ErrorKind::not_converged, fit.trouble};
  const auto motion = estimator::motion_of_runs(fitted, model);
  out.fastest = motion.fastest;
  out.deepest = motion.deepest;
  known.estimate = report::to_document(estimator::published(fitted, model));
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

// The rows and columns `rows` of the estimate's covariance, where all of them are numbers.
void take_covariance(const protocol::EstimateDocument& estimate,
                     const std::vector<std::size_t>& rows, DropKnowledge& out) {
  estimator::DamperHypothesis& h = out.hypothesis;
  const std::size_t size = estimate.covariance_order.size();
  bool finite =
      !rows.empty() && estimate.covariance.size() == size * size && estimate.degrees_of_freedom > 0;
  for (const std::size_t i : rows) {
    for (const std::size_t k : rows) {
      if (!finite) break;
      h.covariance.push_back(estimate.covariance[i * size + k]);
      finite = std::isfinite(h.covariance.back());
    }
  }
  if (!finite) {
    h.numbers.clear();
    h.covariance.clear();
    out.warnings.push_back(
        "the estimate has no covariance (parameters that its data do not determine): no band");
  }
  h.degrees_of_freedom = static_cast<double>(estimate.degrees_of_freedom);
  if (!estimate.usable) out.warnings.push_back("the estimate says of itself that it is not usable");
}

// Puts the estimate's values into the model and its covariance beside it. Names that the model does
// not have (initial states of a transient estimate) are left out.
void take_estimate(const KnownBefore& known, DropKnowledge& out) {
  estimator::DamperHypothesis& h = out.hypothesis;
  h.model = known.spec;
  h.probability = 1.0;
  const auto& estimate = known.estimate;
  if (estimate.parameters.empty()) {
    out.warnings.push_back(
        "no estimate was given: these are the model file's start values, and there is no band");
    return;
  }
  const estimator::Model model(known.spec);
  const auto places = estimator::numbers_of(model);
  const auto index_of = [&](const std::string& name) {
    for (std::size_t k = 0; k < places.size(); ++k) {
      if (model.parameters()[k].name == name) return static_cast<int>(k);
    }
    return -1;
  };
  std::vector<char> met(places.size(), 0);
  for (const auto& entry : estimate.parameters) {
    const int at = index_of(entry.name);
    if (at < 0) continue;
    estimator::set_value(h.model, places[static_cast<std::size_t>(at)], entry.value);
    met[static_cast<std::size_t>(at)] = 1;
  }
  for (std::size_t k = 0; k < places.size(); ++k) {
    if (!met[k])
      throw std::invalid_argument(
          fmt::format("the estimate has no parameter {}; is it one of model '{}'?",
                      model.parameters()[k].name, model.name()));
  }
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < estimate.covariance_order.size(); ++i) {
    const int at = index_of(estimate.covariance_order[i]);
    if (at < 0) continue;
    rows.push_back(i);
    h.numbers.push_back(places[static_cast<std::size_t>(at)]);
  }
  take_covariance(estimate, rows, out);
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
