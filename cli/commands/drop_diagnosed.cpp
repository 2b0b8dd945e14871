// Predicts a drop from a campaign and its diagnosis: the honest band.
#include <cmath>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/campaign_title.hpp"
#include "cli/commands.hpp"
#include "cli/diagnosed_drop.hpp"
#include "cli/dossier.hpp"
#include "cli/drop_figures.hpp"
#include "cli/joined_drop.hpp"
#include "cli/same_damper.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using estimator::kDropFigureCount;
using estimator::kDropFigures;
using estimator::MixtureBand;
using OrderedJson = nlohmann::ordered_json;

bool is_asked(const DiagnosedDrop& p, std::size_t f) {
  return !may_be_absent(f) || std::isfinite(p.drop.bands[f].value);
}

std::string ends_of(double lower, double upper) {
  const double error = 0.25 * (upper - lower);
  if (!(error > 0.0)) return "-";
  return fmt::format("{} to {}", report::rounded_to(lower, error),
                     report::rounded_to(upper, error));
}

void print(const DiagnosedDrop& p) {
  std::vector<std::vector<std::string>> rows = {
      {"figure", "value", "95 %", "95 % (parameters alone)", "unit"}};
  for (std::size_t f = 0; f < kDropFigureCount; ++f) {
    if (!is_asked(p, f)) continue;
    const MixtureBand& b = p.drop.bands[f];
    const double k = p.output.sections.words.scale[f];
    std::vector<std::string> row = {p.output.sections.words.label[f]};
    if (std::isfinite(b.value))
      row.insert(row.end(), {fmt::format("{:.6g}{}", k * b.value, b.median ? " (median)" : ""),
                             ends_of(k * b.lower, k * b.upper),
                             ends_of(k * b.linear_lower, k * b.linear_upper)});
    else
      row.insert(row.end(), {"-", "-", "-"});
    row.push_back(p.output.sections.words.unit[f]);
    rows.push_back(std::move(row));
  }
  fmt::print("{}", report::text_table(rows, std::vector<bool>(rows[0].size(), false)));
  fmt::print("{}", drop_output_text(p.output));
  if (p.measured_fall)
    fmt::print("The measured drop, at {:.4g} {}/s:\n{}",
               p.measured_fall->output.sections.setup.conditions.sink_speed, p.length,
               comparison_text(p.measured_fall->output));
  if (p.joined) fmt::print("{}", joined_text(p));
  for (const auto& h : p.damper.hypotheses)
    fmt::print("hypothesis {}: probability {:.3f}\n", name_of(h), h.probability);
  fmt::print("a force that no hypothesis names: probability {:.3f}\n",
             p.damper.unnamed_probability);
  fmt::print(
      "{:.0f} % of the energy is absorbed outside of the strokes and velocities that the campaign "
      "visited\n",
      100.0 * p.drop.extrapolated_energy_share);
  fmt::print("{}\n", prior_words(p.priors));
  for (const std::string& warning : p.drop.warnings)
    fmt::print("! {}\n", warning);
}

OrderedJson figures_json(const DiagnosedDrop& p) {
  OrderedJson figures = OrderedJson::array();
  for (std::size_t f = 0; f < kDropFigureCount; ++f) {
    if (!is_asked(p, f)) continue;
    const MixtureBand& b = p.drop.bands[f];
    const double k = p.output.sections.words.scale[f];
    OrderedJson entry = {{"name", kDropFigures[f].name}, {"unit", p.output.sections.words.unit[f]}};
    if (std::isfinite(b.value)) {
      entry["value"] = k * b.value;
      entry["value_of"] = b.median ? "median" : "first hypothesis";
      entry["interval"] = {k * b.lower, k * b.upper};
      entry["linear_standard_error"] = k * b.linear_error;
      entry["linear_interval"] = {k * b.linear_lower, k * b.linear_upper};
    }
    figures.push_back(std::move(entry));
  }
  return figures;
}

OrderedJson to_json(const DiagnosedDrop& p) {
  OrderedJson hypotheses = OrderedJson::array();
  for (const auto& h : p.damper.hypotheses)
    hypotheses.push_back({{"effects", h.effects}, {"probability", h.probability}});
  const auto& h = p.drop.run.history;
  const auto& band = p.drop.history;
  OrderedJson out = {
      {"campaign", p.damper.campaign},
      {"verdict", p.damper.verdict},
      {"model", p.damper.hypotheses.front().model.name},
      {"sink_speed", p.output.sections.setup.conditions.sink_speed},
      {"lift", p.output.sections.setup.conditions.lift},
      {"figures", figures_json(p)},
      {"extrapolated_energy_share", p.drop.extrapolated_energy_share},
      {"bottoming_probability", p.drop.bottoming_probability},
      {"hypotheses", std::move(hypotheses)},
      {"unnamed_probability", p.damper.unnamed_probability},
      {"priors",
       {{"cd_spread_per_decade", p.priors.discharge_spread},
        {"index_spread", p.priors.index_spread}}},
      {"warnings", p.drop.warnings},
      {"history",
       {{"t", h.t}, {"stroke", h.stroke}, {"speed", h.speed}, {"load_per_mass", h.load}}},
      {"history_band",
       {{"t", band.t},
        {"stroke_lower", band.stroke_lower},
        {"stroke_upper", band.stroke_upper},
        {"speed_lower", band.speed_lower},
        {"speed_upper", band.speed_upper},
        {"load_per_mass_lower", band.load_lower},
        {"load_per_mass_upper", band.load_upper}}}};
  add_drop_output(p.output, out);
  if (p.measured_fall) {
    const DropOutput& own = p.measured_fall->output;
    out["measured"] = comparison_json(*own.comparison, own.sections.words);
    out["measured"]["sink_speed"] = own.sections.setup.conditions.sink_speed;
    out["measured"]["lift"] = own.sections.setup.conditions.lift;
  }
  if (p.joined) out["joined"] = joined_json(p);
  return out;
}

Result<void> write_drop_page(const DropOptions& options, const DiagnosedDrop& drop) {
  if (options.page.empty()) return {};
  std::ofstream out(options.page);
  out << drop_page(drop, campaign_title(options.campaigns, std::nullopt, "predicted"));
  if (out.flush()) return {};
  return Error{ErrorKind::io, fmt::format("{}: cannot be written", options.page.string())};
}

}  // namespace

int drop_diagnosed(const Common& common, const DropOptions& options) {
  try {
    if (!options.estimate.empty())
      return fail(common, kBadInput,
                  "a diagnosis has its own estimates; leave --estimate or the campaign out");
    std::vector<std::string> warnings;
    const auto damper = damper_for(options, warnings);
    if (!damper) return fail(common, drop_exit_code(damper.error()), damper.error().what);
    auto prediction = predict_diagnosed(options, *damper);
    if (!prediction)
      return fail(common, drop_exit_code(prediction.error()), prediction.error().what);
    auto& told = prediction->drop.warnings;
    told.insert(told.begin(), warnings.begin(), warnings.end());
    if (auto apart = disagreement(options.campaigns, options.model); apart)
      told.push_back(std::move(*apart));
    if (auto drawn = write_drop_picture(options, prediction->output, prediction->drop.run,
                                        prediction->drop.history, nullptr, prediction->length);
        !drawn)
      return fail(common, kBadInput, drawn.error().what);
    if (auto written = write_drop_page(options, *prediction); !written)
      return fail(common, kBadInput, written.error().what);
    if (common.json)
      fmt::print("{}\n",
                 to_json(*prediction).dump(-1, ' ', false, OrderedJson::error_handler_t::replace));
    else
      print(*prediction);
    return prediction->joined && !prediction->joined->drop.intervals_hold ? kIntervals : kOk;
  } catch (const std::invalid_argument& error) {
    return fail(common, kBadInput, error.what());
  }
}

}  // namespace shaker::cli
