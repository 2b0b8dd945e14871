// Predicts a drop test from an identified model: table, JSON, picture.
#include "estimator/time/drop.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "cli/documents_in.hpp"
#include "cli/drop_figures.hpp"
#include "cli/drop_picture.hpp"
#include "cli/estimation_input.hpp"
#include "cli/opened_campaign.hpp"
#include "config/model.hpp"
#include "estimator/estimation.hpp"
#include "estimator/worth/second_order.hpp"
#include "report/estimate_document.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using OrderedJson = nlohmann::ordered_json;
using estimator::DropBand;
using estimator::DropPrediction;
using estimator::kDropFigureCount;
using estimator::kDropFigures;

// The knowledge of the damper: its parameters, their uncertainty, and the range of the data.
struct Identified {
  config::ModelSpec spec;
  protocol::EstimateDocument estimate;  // empty parameters: the model's start values
  std::optional<double> fastest, deepest;
};

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

// Finds the largest stroke and speed in the fitted runs.
void find_range(const estimator::Model& model, const estimator::Estimator& fitted,
                Identified& out) {
  double fastest = 0.0, deepest = -std::numeric_limits<double>::infinity();
  for (const auto& system : fitted.solutions()) {
    const int n = system.points(), c = model.observed();
    for (int i = 0; i < n; ++i) {
      const double next = system.value((i + 1) % n, c), last = system.value((i + n - 1) % n, c);
      fastest = std::max(fastest, std::fabs(next - last) * 0.5 * n * system.frequency());
      deepest = std::max(deepest, system.value(i, c));
    }
  }
  out.fastest = fastest;
  out.deepest = deepest;
}

Result<Identified> from_campaign(const DropOptions& options) {
  InputOptions reading;
  reading.files = {options.campaign};
  reading.model = options.model;
  if (auto good = expect_campaign(options.campaign); !good) return good.error();
  auto data = read_estimation_input(reading);
  if (!data) return data.error();
  Identified out;
  out.spec = std::move(data->model);
  const estimator::Model model(out.spec);
  estimator::Estimator fitted(model, std::move(data->runs));
  const auto& fit = fitted.fit(model.start());
  if (fit.status == estimator::FitStatus::no_solution)
    return Error{ErrorKind::not_converged, fit.trouble};
  find_range(model, fitted, out);
  out.estimate = report::to_document(estimator::published(fitted, model));
  return out;
}

Result<Identified> identified(const DropOptions& options) {
  if (!options.campaign.empty()) return from_campaign(options);
  if (options.model.empty())
    return Error{
        ErrorKind::invalid,
        "what falls? give a CAMPAIGN (with --diagnosis FOLDER where there is one), or --model "
        "MODEL.json with or without --estimate ESTIMATE.json"};
  auto spec = config::load_model(options.model);
  if (!spec) return spec.error();
  Identified out;
  out.spec = std::move(*spec);
  if (!options.estimate.empty()) {
    auto estimate = read_estimate(options.estimate);
    if (!estimate) return estimate.error();
    out.estimate = std::move(*estimate);
  }
  out.fastest = options.identified_speed;
  out.deepest = options.identified_stroke;
  return out;
}

// Parameters and covariance in the model's order. Names that the model does not have (initial
// states of a transient estimate) are left out.
std::vector<double> parameters_of(const Identified& known, const estimator::Model& model,
                                  estimator::DropUncertainty& uncertainty,
                                  std::vector<std::string>& warnings) {
  auto theta = model.start();
  const auto& estimate = known.estimate;
  if (estimate.parameters.empty()) {
    warnings.push_back(
        "no estimate was given: these are the model file's start values, and there is no band");
    return theta;
  }
  const auto index_of = [&](const std::string& name) {
    for (std::size_t k = 0; k < theta.size(); ++k) {
      if (model.parameters()[k].name == name) return static_cast<int>(k);
    }
    return -1;
  };
  std::vector<char> met(theta.size(), 0);
  for (const auto& entry : estimate.parameters) {
    const int at = index_of(entry.name);
    if (at < 0) continue;
    theta[static_cast<std::size_t>(at)] = entry.value;
    met[static_cast<std::size_t>(at)] = 1;
  }
  for (std::size_t k = 0; k < theta.size(); ++k) {
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
    uncertainty.parameters.push_back(at);
  }
  const std::size_t size = estimate.covariance_order.size();
  bool finite =
      !rows.empty() && estimate.covariance.size() == size * size && estimate.degrees_of_freedom > 0;
  for (const std::size_t i : rows) {
    for (const std::size_t k : rows) {
      if (!finite) break;
      uncertainty.covariance.push_back(estimate.covariance[i * size + k]);
      finite = std::isfinite(uncertainty.covariance.back());
    }
  }
  if (!finite) {
    uncertainty.covariance.clear();
    warnings.push_back(
        "the estimate has no covariance (parameters that its data do not determine): no band");
  }
  uncertainty.degrees_of_freedom = static_cast<double>(estimate.degrees_of_freedom);
  if (!estimate.usable) warnings.push_back("the estimate says of itself that it is not usable");
  return theta;
}

void warn_of_extrapolation(const Identified& known, const DropPrediction& drop,
                           const std::string& unit, std::vector<std::string>& warnings) {
  if (!known.fastest || !known.deepest) {
    warnings.push_back(
        "it is not known at which velocities and strokes the model was identified: give "
        "--campaign, or --identified-speed and --identified-stroke");
    return;
  }
  if (drop.run.fastest > 1.05 * *known.fastest)
    warnings.push_back(fmt::format(
        "the drop reaches {:.3g} {}/s, the model was identified up to {:.3g}: {:.1f} times as "
        "fast. "
        "Loads at high speed follow from the form of the damping law, which was not tested there",
        drop.run.fastest, unit, *known.fastest, drop.run.fastest / *known.fastest));
  if (drop.run.figures[0] > 1.02 * *known.deepest)
    warnings.push_back(fmt::format(
        "the drop reaches a stroke of {:.4g} {}, the model was identified up to {:.4g}: an end "
        "stop or the gas near its wall was not tested there",
        drop.run.figures[0], unit, *known.deepest));
}

struct Sheet {
  const DropPrediction* drop = nullptr;
  const std::vector<double>* truth = nullptr;
  std::string length;
  std::optional<double> mass;
  bool band = false;
  double scale(std::size_t f) const {
    return unit(f) == "N" || unit(f) == "J" ? mass.value_or(1.0) : 1.0;
  }
  std::string unit(std::size_t f) const { return figure_unit(f, length, mass.has_value()); }
};

std::string interval(double lower, double upper, double error) {
  return fmt::format("{} to {}", report::rounded_to(lower, error),
                     report::rounded_to(upper, error));
}

void print(const Sheet& sheet, const std::vector<std::string>& warnings) {
  std::vector<std::vector<std::string>> rows = {
      {"figure", "value", "95 % (linearised)", "95 % (sampled)", "unit"}};
  if (sheet.truth != nullptr) rows[0].insert(rows[0].begin() + 4, {"truth", "off"});
  for (std::size_t f = 0; f < kDropFigureCount; ++f) {
    const DropBand& b = sheet.drop->bands[f];
    const double k = sheet.scale(f), error = k * b.error;
    std::vector<std::string> row = {figure_label(f, sheet.mass.has_value())};
    if (!std::isfinite(b.value)) {
      row.insert(row.end(), {"-", "-", "-"});
    } else if (sheet.band && error > 0.0) {
      row.insert(row.end(),
                 {report::with_error(k * b.value, error), interval(k * b.lower, k * b.upper, error),
                  interval(k * b.sampled_lower, k * b.sampled_upper, error)});
    } else {
      row.insert(row.end(), {fmt::format("{:.6g}", k * b.value), "-", "-"});
    }
    if (sheet.truth != nullptr) {
      const double truth = (*sheet.truth)[f];
      row.push_back(fmt::format("{:.6g}", k * truth));
      row.push_back(fmt::format("{:+.2f} %", 100.0 * (b.value / truth - 1.0)));
    }
    row.push_back(sheet.unit(f));
    rows.push_back(std::move(row));
  }
  fmt::print("{}", report::text_table(rows, std::vector<bool>(rows[0].size(), false)));
  for (const std::string& warning : warnings)
    fmt::print("! {}\n", warning);
}

OrderedJson to_json(const Sheet& sheet, const DropOptions& options, const std::string& model,
                    const std::vector<std::string>& warnings) {
  OrderedJson figures = OrderedJson::array();
  for (std::size_t f = 0; f < kDropFigureCount; ++f) {
    const DropBand& b = sheet.drop->bands[f];
    const double k = sheet.scale(f);
    OrderedJson entry = {{"name", kDropFigures[f].name}, {"unit", sheet.unit(f)}};
    if (std::isfinite(b.value)) {
      entry["value"] = k * b.value;
      if (sheet.band) {
        entry["standard_error"] = k * b.error;
        entry["interval"] = {k * b.lower, k * b.upper};
        entry["sampled_interval"] = {k * b.sampled_lower, k * b.sampled_upper};
      }
    }
    if (sheet.truth != nullptr) entry["truth"] = k * (*sheet.truth)[f];
    figures.push_back(std::move(entry));
  }
  const auto& h = sheet.drop->run.history;
  OrderedJson history = {
      {"t", h.t}, {"stroke", h.stroke}, {"speed", h.speed}, {"load_per_mass", h.load}};
  if (sheet.band) {
    history["stroke_standard_error"] = h.stroke_error;
    history["load_standard_error"] = h.load_error;
  }
  OrderedJson out = {{"model", model},
                     {"sink_speed", options.sink_speed},
                     {"lift", options.lift},
                     {"figures", std::move(figures)},
                     {"samples", sheet.drop->samples},
                     {"samples_lost", sheet.drop->lost},
                     {"warnings", warnings},
                     {"history", std::move(history)}};
  if (options.mass) out["mass_kg"] = *options.mass;
  return out;
}

}  // namespace

int drop(const Common& common, const DropOptions& options) {
  if (!options.campaigns.empty() || !options.diagnosis.empty())
    return drop_diagnosed(common, options);
  try {
    auto known = identified(options);
    if (!known) return fail(common, kBadInput, known.error().what);
    if (options.mass && known->spec.length_unit != "m")
      return fail(common, kBadInput,
                  fmt::format("--mass is in kg, but the model counts in {}; leave it out",
                              known->spec.length_unit));
    const estimator::DropConditions conditions{options.sink_speed, options.lift, options.duration,
                                               -1};
    const estimator::DropTest test(known->spec, conditions);
    std::vector<std::string> warnings;
    estimator::DropUncertainty uncertainty;
    uncertainty.samples = options.samples;
    const auto theta = parameters_of(*known, test.model(), uncertainty, warnings);
    const auto prediction = estimator::predict_drop(test, theta, uncertainty);
    if (!prediction) return fail(common, kNotUsable, prediction.error().what);
    warn_of_extrapolation(*known, *prediction, known->spec.length_unit, warnings);
    if (prediction->lost > 0)
      warnings.push_back(fmt::format(
          "{} of {} drawn parameter sets give no drop (outside their bounds, or through the gas "
          "spring's wall); the sampled band is of the rest",
          prediction->lost, prediction->lost + prediction->samples));
    std::optional<estimator::DropRun> truth;
    if (!options.truth.empty()) {
      auto spec = config::load_model(options.truth);
      if (!spec) return fail(common, kBadInput, spec.error().what);
      const estimator::DropTest true_test(*spec, conditions);
      auto run = true_test.run(true_test.model().start(), false);
      if (!run) return fail(common, kBadInput, run.error().what);
      truth = std::move(*run);
    }
    Sheet sheet;
    sheet.drop = &*prediction;
    sheet.truth = truth ? &truth->figures : nullptr;
    sheet.length = known->spec.length_unit;
    sheet.mass = options.mass;
    sheet.band = !uncertainty.covariance.empty();
    if (!options.svg.empty()) {
      std::ofstream out(options.svg);
      out << drop_picture(sheet.drop->run, truth ? &truth->history : nullptr,
                          {options.sink_speed, options.mass, sheet.length});
      if (!out.flush())
        return fail(common, kBadInput, fmt::format("{}: cannot be written", options.svg.string()));
    }
    if (common.json) {
      fmt::print("{}\n", to_json(sheet, options, known->spec.name, warnings).dump());
    } else {
      print(sheet, warnings);
    }
    return kOk;
  } catch (const std::invalid_argument& error) {
    return fail(common, kBadInput, error.what());
  }
}

}  // namespace shaker::cli
