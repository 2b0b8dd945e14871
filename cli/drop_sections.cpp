#include "cli/drop_sections.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include <fmt/format.h>

#include "cli/drop_figures.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using OrderedJson = nlohmann::ordered_json;

constexpr double kInchOfRules = 0.0254;

std::string percents(double share) {
  return fmt::format("{:.2f} %", 100.0 * share);
}

// " (95 %: 1.2 to 1.4)"; nothing for ends that are equal.
std::string in_brackets(double lower, double upper) {
  const double error = 0.25 * (upper - lower);
  if (!(error > 0.0)) return "";
  return fmt::format(" (95 %: {} to {})", report::rounded_to(lower, error),
                     report::rounded_to(upper, error));
}

std::string in_brackets(double k, const std::optional<std::array<double, 2>>& ends) {
  return ends ? in_brackets(k * (*ends)[0], k * (*ends)[1]) : "";
}

DropSection rule_section(const DropSections& s) {
  const estimator::RuleDrop& rule = *s.setup.rule;
  DropSection section = {fmt::format("Conditions by {}, {}", rule.rule, rule.condition), {}};
  const auto add = [&](const char* label, std::string text) {
    section.rows.emplace_back(label, std::move(text));
  };
  add("sink speed", fmt::format("{:.6g} m/s", rule.sink_speed));
  add("height of a free drop",
      fmt::format("{:.6g} m ({:.4g} in)", rule.height, rule.height / kInchOfRules));
  add("weight on the gear", fmt::format("{:.6g} N", rule.weight));
  add(rule.free_drop ? "lift, in the effective weight" : "lift, as a force",
      fmt::format("{:.4g} of the weight", rule.lift));
  if (rule.free_drop) add("effective weight W_e", fmt::format("{:.6g} N", rule.effective_weight));
  add("descent of the mass d", fmt::format("{:.6g} m", rule.descent));
  const double n = rule.load_factor(s.deceleration);
  std::string factor = fmt::format("{:.5g}", n);
  if (s.banded)
    factor +=
        in_brackets(rule.load_factor(s.deceleration_lower), rule.load_factor(s.deceleration_upper));
  add("load factor n", std::move(factor));
  return section;
}

DropSection limits_section(const DropSections& s) {
  DropSection section = {"Limits", {}};
  for (std::size_t i = 0; i < s.setup.limits.size(); ++i)
    section.rows.emplace_back(s.setup.limits[i].text,
                              s.banded
                                  ? fmt::format("met with probability {:.4f}", s.met[i])
                                  : std::string(s.met[i] > 0.5 ? "met by the values alone"
                                                               : "exceeded by the values alone"));
  return section;
}

std::string ends_by(estimator::StrokeEnd::By by) {
  using By = estimator::StrokeEnd::By;
  if (by == By::end_stop) return "where the end stop is met";
  if (by == By::gas)
    return "where the gas would be crushed to nothing; a real strut ends before (--stroke-limit)";
  return "of --stroke-limit";
}

DropSection margin_section(const DropSections& s) {
  DropSection section = {"Margin to bottoming", {}};
  const std::string& length = s.words.unit[figure_called("peak_stroke")];
  if (s.stroke_end.by == estimator::StrokeEnd::By::nothing) {
    section.rows.emplace_back("not known",
                              "the model ends at no stroke; give --stroke-limit, as 350mm");
    return section;
  }
  section.rows.emplace_back("greatest stroke", fmt::format("{:.6g} {}, {}", s.stroke_end.stroke,
                                                           length, ends_by(s.stroke_end.by)));
  section.rows.emplace_back(
      "left at the peak stroke",
      fmt::format("{:.6g} {}{}", s.margin, length, in_brackets(s.margin_lower, s.margin_upper)));
  section.rows.emplace_back("bottoming", s.bottoming
                                             ? fmt::format("with probability {:.4f}", *s.bottoming)
                                         : s.margin > 0.0 ? std::string("not by the values alone")
                                                          : std::string("by the values alone"));
  return section;
}

DropSection shares_section(const DropSections& s) {
  DropSection section = {"What carries the load", {}};
  for (const estimator::EffectShare& share : s.shares.effects)
    section.rows.emplace_back(
        fmt::format("{} ({})", share.effect, estimator::effect_family(share.effect)),
        fmt::format("{} of the peak load, {} of the energy", percents(share.of_peak_load),
                    percents(share.of_energy)));
  section.rows.emplace_back("balance of energy",
                            fmt::format("closed to {:.1e}", s.shares.energy_residual));
  if (s.gas_pressure)
    section.rows.emplace_back("largest gas pressure",
                              fmt::format("{:.5g} bar", *s.gas_pressure * 1e-5));
  return section;
}

// A state of the envelope, which is beside that in which the damper falls.
std::string state_words(const DropSections& s, const estimator::ServicingState& beside) {
  const estimator::ServicingState state = s.setup.state.with(beside);
  return fmt::format("charge {:.3g}, oil {:+.3g}, {:.3g} degC", state.charge, state.oil,
                     s.setup.tested_temperature + state.temperature);
}

// What a figure is in a corner of the ranges, and with which probability there is no drop.
std::string corner_words(const DropSections& s, const estimator::ServicingBand& corner) {
  if (corner.figures.empty()) return "no drop: the stroke ends before it turns";
  std::string words;
  for (std::size_t i = 0; i < corner.figures.size(); ++i) {
    const std::size_t f = s.envelope->figures[i].figure;
    const estimator::FigureInterval& own = corner.figures[i];
    const double k = s.words.scale[f];
    words += fmt::format("{}{} {:.5g}{}{}", i == 0 ? "" : "; ", s.words.label[f], k * own.value,
                         s.words.unit[f] == "-" ? "" : " " + s.words.unit[f],
                         in_brackets(k * own.lower, k * own.upper));
  }
  if (corner.without_drop > 0.0)
    words += fmt::format("; no drop with probability {:.4f}", corner.without_drop);
  return words;
}

DropSection envelope_section(const DropSections& s) {
  DropSection section = {
      s.envelope->corners.empty() ? "Servicing envelope, at the estimates" : "Servicing envelope",
      {}};
  for (const estimator::EnvelopeFigure& f : s.envelope->figures) {
    const double k = s.words.scale[f.figure];
    const std::string unit = s.words.unit[f.figure] == "-" ? "" : " " + s.words.unit[f.figure];
    const std::string& label = s.words.label[f.figure];
    section.rows.emplace_back(label + ", least", fmt::format("{:.5g}{}{} at {}", k * f.least, unit,
                                                             in_brackets(k, f.least_interval),
                                                             state_words(s, f.least_at)));
    section.rows.emplace_back(
        label + ", greatest",
        fmt::format("{:.5g}{}{} at {}", k * f.greatest, unit, in_brackets(k, f.greatest_interval),
                    state_words(s, f.greatest_at)));
    section.rows.emplace_back(label + ", 5, 50 and 95 % of states, at the estimates",
                              fmt::format("{:.5g}, {:.5g} and {:.5g}{}", k * f.quantiles[0],
                                          k * f.quantiles[1], k * f.quantiles[2], unit));
  }
  for (const estimator::ServicingBand& corner : s.envelope->corners)
    section.rows.emplace_back(state_words(s, corner.state), corner_words(s, corner));
  if (s.envelope->without > 0)
    section.rows.emplace_back(
        "no drop", fmt::format("in {} of {} states, first at {}: the stroke ends before it turns",
                               s.envelope->without, s.envelope->drops,
                               state_words(s, s.envelope->without_at)));
  return section;
}

OrderedJson state_json(const DropSections& s, const estimator::ServicingState& beside) {
  const estimator::ServicingState at = s.setup.state.with(beside);
  return {{"charge", at.charge},
          {"oil", at.oil},
          {"temperature_degC", s.setup.tested_temperature + at.temperature}};
}

OrderedJson corner_json(const DropSections& s, const estimator::ServicingBand& corner) {
  OrderedJson figures = OrderedJson::array();
  for (std::size_t i = 0; i < corner.figures.size(); ++i) {
    const std::size_t f = s.envelope->figures[i].figure;
    const estimator::FigureInterval& own = corner.figures[i];
    const double k = s.words.scale[f];
    figures.push_back({{"name", estimator::kDropFigures[f].name},
                       {"unit", s.words.unit[f]},
                       {"value", k * own.value},
                       {"interval", {k * own.lower, k * own.upper}}});
  }
  return {{"state", state_json(s, corner.state)},
          {"figures", std::move(figures)},
          {"no_drop_probability", corner.without_drop}};
}

OrderedJson envelope_json(const DropSections& s) {
  OrderedJson figures = OrderedJson::array(), corners = OrderedJson::array();
  for (const estimator::EnvelopeFigure& f : s.envelope->figures) {
    const double k = s.words.scale[f.figure];
    OrderedJson entry = {
        {"name", estimator::kDropFigures[f.figure].name},
        {"unit", s.words.unit[f.figure]},
        {"least", k * f.least},
        {"least_at", state_json(s, f.least_at)},
        {"greatest", k * f.greatest},
        {"greatest_at", state_json(s, f.greatest_at)},
        {"quantiles_5_50_95", {k * f.quantiles[0], k * f.quantiles[1], k * f.quantiles[2]}}};
    if (f.least_interval)
      entry["least_interval"] = {k * (*f.least_interval)[0], k * (*f.least_interval)[1]};
    if (f.greatest_interval)
      entry["greatest_interval"] = {k * (*f.greatest_interval)[0], k * (*f.greatest_interval)[1]};
    figures.push_back(std::move(entry));
  }
  for (const estimator::ServicingBand& corner : s.envelope->corners)
    corners.push_back(corner_json(s, corner));
  OrderedJson out = {{"figures", std::move(figures)},
                     {"drops", s.envelope->drops},
                     {"without_drop", s.envelope->without}};
  if (!corners.empty()) out["corners"] = std::move(corners);
  return out;
}

void add_margin(const DropSections& s, OrderedJson& out) {
  using By = estimator::StrokeEnd::By;
  if (s.stroke_end.by == By::nothing) return;
  const char* by = s.stroke_end.by == By::gas        ? "gas_spring"
                   : s.stroke_end.by == By::end_stop ? "end_stop"
                                                     : "stroke_limit";
  out["stroke_end"] = {{"value", s.stroke_end.stroke},
                       {"unit", s.words.unit[figure_called("peak_stroke")]},
                       {"by", by}};
  if (s.bottoming) out["bottoming_probability"] = *s.bottoming;
}

}  // namespace

std::optional<double> gas_pressure(const estimator::DropShares& shares, double mass, double area) {
  std::vector<double> force;
  for (const estimator::EffectShare& share : shares.effects) {
    if (estimator::effect_family(share.effect) != "gas" || share.effect == "second_chamber")
      continue;
    force.resize(share.load.size(), 0.0);
    for (std::size_t i = 0; i < force.size(); ++i)
      force[i] += share.load[i];
  }
  if (force.empty()) return std::nullopt;
  return *std::max_element(force.begin(), force.end()) * mass / area;
}

std::vector<DropSection> drop_sections(const DropSections& s) {
  std::vector<DropSection> sections;
  if (s.setup.rule) sections.push_back(rule_section(s));
  if (!s.setup.state.as_tested())
    sections.push_back({"Servicing", {{"the damper falls with", state_words(s, {})}}});
  if (!s.setup.limits.empty()) sections.push_back(limits_section(s));
  sections.push_back(margin_section(s));
  if (!s.shares.effects.empty()) sections.push_back(shares_section(s));
  if (s.envelope) sections.push_back(envelope_section(s));
  return sections;
}

std::string drop_sections_text(const DropSections& sections) {
  std::string text;
  for (const DropSection& section : drop_sections(sections)) {
    std::vector<std::vector<std::string>> rows = {{section.heading, ""}};
    for (const auto& [label, said] : section.rows)
      rows.push_back({label, said});
    text += report::text_table(rows, {false, false}) + "\n";
  }
  return text;
}

void add_drop_sections(const DropSections& s, OrderedJson& out) {
  if (s.setup.rule) {
    const estimator::RuleDrop& rule = *s.setup.rule;
    OrderedJson factor = {{"value", rule.load_factor(s.deceleration)}};
    if (s.banded)
      factor["interval"] = {rule.load_factor(s.deceleration_lower),
                            rule.load_factor(s.deceleration_upper)};
    out["rule"] = {{"rule", rule.rule},
                   {"condition", rule.condition},
                   {"height_m", rule.height},
                   {"sink_speed", rule.sink_speed},
                   {"weight_N", rule.weight},
                   {"lift", rule.lift},
                   {"effective_weight_N", rule.effective_weight},
                   {"descent_m", rule.descent},
                   {"load_factor", std::move(factor)},
                   {"drops", rule.drops}};
  }
  OrderedJson limits = OrderedJson::array();
  for (std::size_t i = 0; i < s.setup.limits.size(); ++i) {
    OrderedJson limit = {{"name", s.setup.limits[i].name}, {"limit", s.setup.limits[i].text}};
    if (s.banded)
      limit["probability"] = s.met[i];
    else
      limit["met"] = s.met[i] > 0.5;
    limits.push_back(std::move(limit));
  }
  if (!limits.empty()) out["limits"] = std::move(limits);
  OrderedJson shares = OrderedJson::array();
  for (const estimator::EffectShare& share : s.shares.effects)
    shares.push_back({{"effect", share.effect},
                      {"family", std::string(estimator::effect_family(share.effect))},
                      {"of_peak_load", share.of_peak_load},
                      {"of_energy", share.of_energy}});
  out["shares"] = std::move(shares);
  out["energy_residual"] = s.shares.energy_residual;
  if (s.gas_pressure) out["gas_pressure_Pa"] = *s.gas_pressure;
  add_margin(s, out);
  if (!s.setup.state.as_tested()) out["state"] = state_json(s, {});
  if (s.envelope) out["servicing"] = envelope_json(s);
  if (s.setup.mass) out["mass_kg"] = *s.setup.mass;
}

}  // namespace shaker::cli
