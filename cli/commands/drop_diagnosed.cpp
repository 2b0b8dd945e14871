// Predicts a drop from a campaign and its diagnosis: the honest band.
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "base/heap.hpp"
#include "cli/commands.hpp"
#include "cli/drop_figures.hpp"
#include "cli/drop_picture.hpp"
#include "cli/opened_campaign.hpp"
#include "estimator/discrepancy/diagnose.hpp"
#include "estimator/time/drop_mixture.hpp"
#include "report/damper_document.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using estimator::DropMixture;
using estimator::IdentifiedDamper;
using estimator::kDropFigureCount;
using estimator::kDropFigures;
using estimator::MixtureBand;
using OrderedJson = nlohmann::ordered_json;

Result<IdentifiedDamper> diagnosed_now(const DropOptions& options) {
  keep_freed_memory();
  auto opened = open_campaigns(options.campaigns, options.model);
  if (!opened) return opened.error();
  using estimator::discrepancy::CalibrationCache;
  CalibrationCache calibrations(CalibrationCache::user_folder());
  estimator::discrepancy::DiagnoseOptions wanted;
  wanted.calibrations = &calibrations;
  auto found = estimator::discrepancy::diagnose(opened->campaign, opened->model, wanted);
  if (!found) return found.error();
  return std::move(found->damper);
}

Result<IdentifiedDamper> damper_for(const DropOptions& options) {
  for (const auto& place : options.campaigns) {
    if (auto good = expect_campaign(place); !good) return good.error();
  }
  return options.diagnosis.empty() ? diagnosed_now(options)
                                   : report::read_damper(options.diagnosis);
}

// What a prediction is printed with.
struct Prediction {
  const IdentifiedDamper* damper = nullptr;
  const DropMixture* drop = nullptr;
  const DropOptions* options = nullptr;
  std::string length;

  bool newton() const { return options->mass.has_value(); }
  std::string unit(std::size_t f) const { return figure_unit(f, length, newton()); }
  double scale(std::size_t f) const {
    return unit(f) == "N" || unit(f) == "J" ? options->mass.value_or(1.0) : 1.0;
  }
};

std::string name_of(const estimator::DamperHypothesis& h) {
  return h.effects.empty() ? "nothing is missing" : fmt::format("{}", fmt::join(h.effects, " + "));
}

std::string ends_of(double lower, double upper) {
  const double error = 0.25 * (upper - lower);
  if (!(error > 0.0)) return "-";
  return fmt::format("{} to {}", report::rounded_to(lower, error),
                     report::rounded_to(upper, error));
}

void print(const Prediction& p) {
  std::vector<std::vector<std::string>> rows = {
      {"figure", "value", "95 %", "95 % (parameters alone)", "unit"}};
  for (std::size_t f = 0; f < kDropFigureCount; ++f) {
    const MixtureBand& b = p.drop->bands[f];
    const double k = p.scale(f);
    std::vector<std::string> row = {figure_label(f, p.newton())};
    if (std::isfinite(b.value))
      row.insert(row.end(), {fmt::format("{:.6g}", k * b.value), ends_of(k * b.lower, k * b.upper),
                             ends_of(k * b.linear_lower, k * b.linear_upper)});
    else
      row.insert(row.end(), {"-", "-", "-"});
    row.push_back(p.unit(f));
    rows.push_back(std::move(row));
  }
  fmt::print("{}\n", report::text_table(rows, std::vector<bool>(rows[0].size(), false)));
  for (const auto& h : p.damper->hypotheses)
    fmt::print("hypothesis {}: probability {:.3f}\n", name_of(h), h.probability);
  fmt::print("a force that no hypothesis names: probability {:.3f}\n",
             p.damper->unnamed_probability);
  fmt::print(
      "{:.0f} % of the energy is absorbed outside of the strokes and velocities that the campaign "
      "visited\n",
      100.0 * p.drop->extrapolated_energy_share);
  for (const std::string& warning : p.drop->warnings)
    fmt::print("! {}\n", warning);
}

OrderedJson figures_json(const Prediction& p) {
  OrderedJson figures = OrderedJson::array();
  for (std::size_t f = 0; f < kDropFigureCount; ++f) {
    const MixtureBand& b = p.drop->bands[f];
    const double k = p.scale(f);
    OrderedJson entry = {{"name", kDropFigures[f].name}, {"unit", p.unit(f)}};
    if (std::isfinite(b.value)) {
      entry["value"] = k * b.value;
      entry["interval"] = {k * b.lower, k * b.upper};
      entry["linear_standard_error"] = k * b.linear_error;
      entry["linear_interval"] = {k * b.linear_lower, k * b.linear_upper};
    }
    figures.push_back(std::move(entry));
  }
  return figures;
}

OrderedJson to_json(const Prediction& p) {
  OrderedJson hypotheses = OrderedJson::array();
  for (const auto& h : p.damper->hypotheses)
    hypotheses.push_back({{"effects", h.effects}, {"probability", h.probability}});
  const auto& h = p.drop->run.history;
  const auto& band = p.drop->history;
  OrderedJson out = {
      {"campaign", p.damper->campaign},
      {"verdict", p.damper->verdict},
      {"model", p.damper->hypotheses.front().model.name},
      {"sink_speed", p.options->sink_speed},
      {"lift", p.options->lift},
      {"figures", figures_json(p)},
      {"extrapolated_energy_share", p.drop->extrapolated_energy_share},
      {"bottoming_probability", p.drop->bottoming_probability},
      {"hypotheses", std::move(hypotheses)},
      {"unnamed_probability", p.damper->unnamed_probability},
      {"warnings", p.drop->warnings},
      {"history",
       {{"t", h.t}, {"stroke", h.stroke}, {"speed", h.speed}, {"load_per_mass", h.load}}},
      {"history_band",
       {{"t", band.t},
        {"stroke_lower", band.stroke_lower},
        {"stroke_upper", band.stroke_upper},
        {"load_per_mass_lower", band.load_lower},
        {"load_per_mass_upper", band.load_upper}}}};
  if (p.options->mass) out["mass_kg"] = *p.options->mass;
  return out;
}

Result<void> draw(const Prediction& p) {
  if (p.options->svg.empty()) return {};
  std::ofstream out(p.options->svg);
  out << drop_picture(p.drop->run, nullptr, {p.options->sink_speed, p.options->mass, p.length});
  if (out.flush()) return {};
  return Error{ErrorKind::io, fmt::format("{}: cannot be written", p.options->svg.string())};
}

}  // namespace

int drop_diagnosed(const Common& common, const DropOptions& options) {
  try {
    if (!options.estimate.empty())
      return fail(common, kBadInput,
                  "a diagnosis has its own estimates; leave --estimate or the campaign out");
    const auto damper = damper_for(options);
    if (!damper)
      return fail(common, damper.error().kind == ErrorKind::not_converged ? kNotUsable : kBadInput,
                  damper.error().what);
    const std::string length = damper->hypotheses.front().model.length_unit;
    if (options.mass && length != "m")
      return fail(common, kBadInput,
                  fmt::format("--mass is in kg, but the model counts in {}; leave it out", length));
    const auto drop =
        estimator::predict_drop(*damper, {options.sink_speed, options.lift, options.duration, -1});
    if (!drop) return fail(common, kNotUsable, drop.error().what);
    const Prediction prediction{&*damper, &*drop, &options, length};
    if (auto drawn = draw(prediction); !drawn) return fail(common, kBadInput, drawn.error().what);
    if (common.json)
      fmt::print("{}\n",
                 to_json(prediction).dump(-1, ' ', false, OrderedJson::error_handler_t::replace));
    else
      print(prediction);
    return kOk;
  } catch (const std::invalid_argument& error) {
    return fail(common, kBadInput, error.what());
  }
}

}  // namespace shaker::cli
