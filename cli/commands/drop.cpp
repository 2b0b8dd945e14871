// Predicts a drop test from an identified model: table, JSON, picture.
#include "estimator/drop/drop.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "cli/drop_figures.hpp"
#include "cli/drop_knowledge.hpp"
#include "cli/drop_output.hpp"
#include "cli/drop_picture.hpp"
#include "config/model.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using OrderedJson = nlohmann::ordered_json;
using estimator::DropBand;
using estimator::DropPrediction;
using estimator::kDropFigureCount;
using estimator::kDropFigures;

void warn_of_extrapolation(const DropKnowledge& known, const DropPrediction& drop,
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
  const ComparisonWords* words = nullptr;
  bool band = false;
  double scale(std::size_t f) const { return words->scale[f]; }
  bool asked(std::size_t f) const {
    return !may_be_absent(f) || std::isfinite(drop->bands[f].value);
  }
};

std::string interval(double lower, double upper, double error) {
  return fmt::format("{} to {}", report::rounded_to(lower, error),
                     report::rounded_to(upper, error));
}

void print(const Sheet& sheet) {
  std::vector<std::vector<std::string>> rows = {
      {"figure", "value", "95 % (linearised)", "95 % (sampled)", "unit"}};
  if (sheet.truth != nullptr) rows[0].insert(rows[0].begin() + 4, {"truth", "off"});
  for (std::size_t f = 0; f < kDropFigureCount; ++f) {
    if (!sheet.asked(f)) continue;
    const DropBand& b = sheet.drop->bands[f];
    const double k = sheet.scale(f), error = k * b.error;
    std::vector<std::string> row = {sheet.words->label[f]};
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
    row.push_back(sheet.words->unit[f]);
    rows.push_back(std::move(row));
  }
  fmt::print("{}", report::text_table(rows, std::vector<bool>(rows[0].size(), false)));
}

OrderedJson to_json(const Sheet& sheet, const estimator::DropConditions& conditions,
                    const std::string& model, const std::vector<std::string>& warnings) {
  OrderedJson figures = OrderedJson::array();
  for (std::size_t f = 0; f < kDropFigureCount; ++f) {
    if (!sheet.asked(f)) continue;
    const DropBand& b = sheet.drop->bands[f];
    const double k = sheet.scale(f);
    OrderedJson entry = {{"name", kDropFigures[f].name}, {"unit", sheet.words->unit[f]}};
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
                     {"sink_speed", conditions.sink_speed},
                     {"lift", conditions.lift},
                     {"figures", std::move(figures)},
                     {"samples", sheet.drop->samples},
                     {"samples_lost", sheet.drop->lost},
                     {"warnings", warnings},
                     {"history", std::move(history)}};
  return out;
}

// The covariance of a hypothesis in the order of the model's parameters.
estimator::DropUncertainty uncertainty_of(const estimator::DamperHypothesis& h,
                                          const estimator::Model& model, int samples) {
  estimator::DropUncertainty uncertainty;
  uncertainty.samples = samples;
  uncertainty.covariance = h.covariance;
  uncertainty.degrees_of_freedom = h.degrees_of_freedom;
  const auto places = estimator::numbers_of(model);
  for (const estimator::ModelNumber& number : h.numbers) {
    const auto at = std::find_if(places.begin(), places.end(), [&](const auto& place) {
      return place.line == number.line && place.symbol == number.symbol;
    });
    uncertainty.parameters.push_back(static_cast<int>(at - places.begin()));
  }
  return uncertainty;
}

PredictedDrop as_predicted(const DropPrediction& prediction) {
  PredictedDrop predicted;
  predicted.history = &prediction.run.history;
  predicted.band = linear_band(prediction.run.history);
  for (const DropBand& band : prediction.bands)
    predicted.figures.push_back({band.value, band.sampled_lower, band.sampled_upper});
  return predicted;
}

double share_within(const DropPrediction& prediction, std::size_t figure, double limit) {
  const auto& drawn = prediction.drawn.at(figure);
  const auto within = std::upper_bound(drawn.begin(), drawn.end(), limit) - drawn.begin();
  return static_cast<double>(within) / (prediction.samples + prediction.lost - prediction.outside);
}

Result<std::optional<estimator::DropRun>> true_run(const DropOptions& options,
                                                   const DropSetup& setup) {
  if (options.truth.empty()) return std::optional<estimator::DropRun>();
  auto spec = config::load_model(options.truth);
  if (!spec) return spec.error();
  const estimator::DropTest test(setup.falling(*spec), setup.conditions);
  auto run = test.run(test.model().start(), false);
  if (!run) return Error{ErrorKind::invalid, run.error().what};
  return std::optional(std::move(*run));
}

// What only a diagnosed damper has, as a sentence; null: nothing of it was asked for.
const char* needs_diagnosis(const DropOptions& options) {
  if (!options.page.empty())
    return "--page needs a CAMPAIGN or a --diagnosis; --svg draws this one";
  if (options.discharge_spread > 0.0 || options.index_spread > 0.0)
    return "--cd-spread and --index-spread widen the band of a CAMPAIGN or a --diagnosis";
  if (options.join || options.measured_sink_speed || options.measured_lift || options.measured_mass)
    return "--join and the conditions of a measured drop need a CAMPAIGN or a --diagnosis";
  return nullptr;
}

int predict_undiagnosed(const Common& common, const DropOptions& options) {
  if (const char* why = needs_diagnosis(options); why != nullptr)
    return fail(common, kBadInput, why);
  auto known = drop_knowledge(options);
  if (!known) return fail(common, kBadInput, known.error().what);
  DropOutput output;
  auto setup = set_up_drop(options, known->hypothesis.model);
  if (!setup) return fail(common, drop_exit_code(setup.error()), setup.error().what);
  output.sections.setup = std::move(*setup);
  const auto falling = output.sections.setup.falling(known->hypothesis);
  const estimator::DropTest test(falling.model, output.sections.setup.conditions);
  const auto uncertainty = uncertainty_of(falling, test.model(), options.samples);
  const auto prediction = estimator::predict_drop(test, test.model().start(), uncertainty);
  if (!prediction) return fail(common, kNotUsable, prediction.error().what);
  auto& warnings = known->warnings;
  if (const auto& rule = output.sections.setup.rule; rule && !rule->remark.empty())
    warnings.push_back(rule->remark);
  warn_of_extrapolation(*known, *prediction, falling.model.length_unit, warnings);
  if (prediction->lost > 0)
    warnings.push_back(fmt::format(
        "{} of {} drawn parameter sets give no drop (outside their bounds, or through the gas "
        "spring's wall); the sampled band is of the rest",
        prediction->lost, prediction->lost + prediction->samples));
  const auto truth = true_run(options, output.sections.setup);
  if (!truth) return fail(common, kBadInput, truth.error().what);
  const PredictedDrop predicted = as_predicted(*prediction);
  output.sections.banded = !uncertainty.covariance.empty();
  const auto within = [&](std::size_t f, double limit) {
    return share_within(*prediction, f, limit);
  };
  estimator::IdentifiedDamper damper;
  damper.hypotheses = {falling};
  if (auto done = complete(
          options, {falling.model, output.sections.banded ? &damper : nullptr, predicted, within},
          output);
      !done)
    return fail(common, drop_exit_code(done.error()), done.error().what);
  const auto* true_history = *truth ? &(*truth)->history : nullptr;
  if (auto drawn = write_drop_picture(options, output, prediction->run, predicted.band,
                                      true_history, falling.model.length_unit);
      !drawn)
    return fail(common, kBadInput, drawn.error().what);
  Sheet sheet;
  sheet.drop = &*prediction;
  sheet.truth = *truth ? &(*truth)->figures : nullptr;
  sheet.words = &output.sections.words;
  sheet.band = output.sections.banded;
  if (common.json) {
    auto json = to_json(sheet, output.sections.setup.conditions, falling.model.name, warnings);
    add_drop_output(output, json);
    fmt::print("{}\n", json.dump());
    return kOk;
  }
  print(sheet);
  fmt::print("{}", drop_output_text(output));
  for (const std::string& warning : warnings)
    fmt::print("! {}\n", warning);
  return kOk;
}

}  // namespace

int drop(const Common& common, const DropOptions& options) {
  if (!options.campaigns.empty() || !options.diagnosis.empty())
    return drop_diagnosed(common, options);
  try {
    return predict_undiagnosed(common, options);
  } catch (const std::invalid_argument& error) {
    return fail(common, kBadInput, error.what());
  }
}

}  // namespace shaker::cli
