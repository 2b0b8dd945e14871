#include "cli/drop_sections.hpp"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using OrderedJson = nlohmann::ordered_json;

constexpr double kInchOfRules = 0.0254;

struct Family {
  std::string_view name;
  std::vector<std::string_view> effects;
};
const std::vector<Family>& families() {
  static const std::vector<Family> all = {
      {"gas", {"gas_spring", "real_gas", "gas_heat_transfer", "dissolved_gas", "second_chamber"}},
      {"orifice",
       {"orifice_damping", "laminar_orifice", "metering_pin", "rebound_damping", "relief_valve",
        "cavitation"}},
      {"friction",
       {"coulomb_friction", "pressure_friction", "stribeck_friction", "presliding_friction",
        "bouc_wen_hysteresis"}}};
  return all;
}

std::string percents(double share) {
  return fmt::format("{:.2f} %", 100.0 * share);
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
  if (s.banded) {
    const double low = rule.load_factor(s.deceleration_lower),
                 high = rule.load_factor(s.deceleration_upper);
    factor += fmt::format(" (95 %: {} to {})", report::rounded_to(low, 0.25 * (high - low)),
                          report::rounded_to(high, 0.25 * (high - low)));
  }
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

DropSection shares_section(const DropSections& s) {
  DropSection section = {"What carries the load", {}};
  for (const estimator::EffectShare& share : s.shares.effects)
    section.rows.emplace_back(fmt::format("{} ({})", share.effect, effect_family(share.effect)),
                              fmt::format("{} of the peak load, {} of the energy",
                                          percents(share.of_peak_load), percents(share.of_energy)));
  section.rows.emplace_back("balance of energy",
                            fmt::format("closed to {:.1e}", s.shares.energy_residual));
  if (s.gas_pressure)
    section.rows.emplace_back("largest gas pressure",
                              fmt::format("{:.5g} bar", *s.gas_pressure * 1e-5));
  return section;
}

}  // namespace

std::optional<double> gas_pressure(const estimator::DropShares& shares, double mass, double area) {
  std::vector<double> force;
  for (const estimator::EffectShare& share : shares.effects) {
    if (effect_family(share.effect) != "gas" || share.effect == "second_chamber") continue;
    force.resize(share.load.size(), 0.0);
    for (std::size_t i = 0; i < force.size(); ++i)
      force[i] += share.load[i];
  }
  if (force.empty()) return std::nullopt;
  return *std::max_element(force.begin(), force.end()) * mass / area;
}

std::string effect_family(const std::string& effect) {
  for (const Family& family : families()) {
    if (std::find(family.effects.begin(), family.effects.end(), effect) != family.effects.end())
      return std::string(family.name);
  }
  return "other";
}

std::vector<DropSection> drop_sections(const DropSections& s) {
  std::vector<DropSection> sections;
  if (s.setup.rule) sections.push_back(rule_section(s));
  if (!s.setup.limits.empty()) sections.push_back(limits_section(s));
  if (!s.shares.effects.empty()) sections.push_back(shares_section(s));
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
                      {"family", effect_family(share.effect)},
                      {"of_peak_load", share.of_peak_load},
                      {"of_energy", share.of_energy}});
  out["shares"] = std::move(shares);
  out["energy_residual"] = s.shares.energy_residual;
  if (s.gas_pressure) out["gas_pressure_Pa"] = *s.gas_pressure;
  if (s.setup.mass) out["mass_kg"] = *s.setup.mass;
}

}  // namespace shaker::cli
