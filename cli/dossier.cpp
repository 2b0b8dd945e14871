#include "cli/dossier.hpp"

#include <cmath>

#include <fmt/format.h>

#include "cli/drop_figures.hpp"
#include "cli/drop_picture.hpp"
#include "cli/joined_drop.hpp"
#include "report/diagnosis_page.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using estimator::diagnosis::Diagnosis;
using estimator::diagnosis::Kind;
using estimator::diagnosis::Recording;
using estimator::diagnosis::Role;
using report::page_cell;
using report::page_table;
using report::PageValues;

PageValues page_row(const std::vector<std::string>& texts, const std::vector<bool>& right) {
  PageValues row = PageValues::array();
  for (std::size_t i = 0; i < texts.size(); ++i)
    row.push_back(page_cell(texts[i], right[i]));
  return row;
}

// The first of `rows` is the head.
PageValues table_of(const std::vector<std::vector<std::string>>& rows,
                    const std::vector<bool>& right) {
  PageValues lines = PageValues::array();
  for (std::size_t i = 1; i < rows.size(); ++i)
    lines.push_back(page_row(rows[i], right));
  return page_table(page_row(rows.front(), right), std::move(lines));
}

std::string interval_words(double lower, double upper) {
  const double error = 0.25 * (upper - lower);
  if (!(error > 0.0)) return "-";
  return fmt::format("{} to {}", report::rounded_to(lower, error),
                     report::rounded_to(upper, error));
}

PageValues runs_table(const OpenedCampaign& opened) {
  static constexpr const char* kKinds[] = {"periodic", "imposed motion", "transient"};
  std::vector<std::vector<std::string>> rows = {
      {"run", "kind", "frequency, Hz", "amplitude", "samples", "seconds", "role"}};
  for (const Recording& run : opened.campaign.runs) {
    const std::string unit = run.kind == Kind::imposed_motion ? opened.model.length_unit
                                                              : opened.model.length_unit + "/s^2";
    rows.push_back({run.name, kKinds[static_cast<int>(run.kind)],
                    run.frequency_hz > 0.0 ? fmt::format("{:g}", run.frequency_hz) : "-",
                    run.amplitude > 0.0 ? fmt::format("{:g} {}", run.amplitude, unit) : "-",
                    std::to_string(run.t.size()),
                    fmt::format("{:.4g}", run.t.empty() ? 0.0 : run.t.back() - run.t.front()),
                    run.role == Role::held_out ? "held out" : "fitted"});
  }
  return table_of(rows, {false, false, true, true, true, true, false});
}

// The numbers of the model that the diagnosis chose.
PageValues estimate_table(const Diagnosis& d) {
  const auto& chosen = d.effects.empty() ? d.parameters_before : d.parameters_after;
  std::vector<std::vector<std::string>> rows = {{"parameter", "of", "value", "95 %", "unit"}};
  for (const estimator::ParameterEstimate& p : chosen) {
    const bool known = p.determined && !p.fixed && std::isfinite(p.lower) && std::isfinite(p.upper);
    rows.push_back({p.name, p.effect,
                    p.determined ? report::with_error(p.value, p.standard_error) : "not determined",
                    known ? interval_words(p.lower, p.upper) : (p.fixed ? "fixed" : "-"), p.unit});
  }
  return table_of(rows, {false, false, true, true, false});
}

std::string estimate_sentence(const Diagnosis& d) {
  return fmt::format(
      "Model {}{}. The values are those of the model that the diagnosis chose; with their standard "
      "errors and 95 % intervals.",
      d.model, d.effects.empty() ? ", to which nothing was added" : " with what was missing");
}

PageValues figures_table(const DiagnosedDrop& drop) {
  const ComparisonWords& words = drop.output.sections.words;
  std::vector<std::vector<std::string>> rows = {
      {"figure", "value", "95 %", "95 % (parameters alone)", "unit"}};
  for (std::size_t f = 0; f < estimator::kDropFigureCount; ++f) {
    const estimator::MixtureBand& b = drop.drop.bands[f];
    if (may_be_absent(f) && !std::isfinite(b.value)) continue;
    const double k = words.scale[f];
    const bool known = std::isfinite(b.value);
    rows.push_back({words.label[f], known ? fmt::format("{:.6g}", k * b.value) : "-",
                    known ? interval_words(k * b.lower, k * b.upper) : "-",
                    known ? interval_words(k * b.linear_lower, k * b.linear_upper) : "-",
                    words.unit[f]});
  }
  return table_of(rows, {false, true, true, true, false});
}

PageValues hypotheses_table(const DiagnosedDrop& drop) {
  std::vector<std::vector<std::string>> rows = {{"hypothesis", "probability"}};
  for (const auto& h : drop.damper.hypotheses)
    rows.push_back({name_of(h), fmt::format("{:.3f}", h.probability)});
  rows.push_back({"a force that no hypothesis names, besides",
                  fmt::format("{:.3f}", drop.damper.unnamed_probability)});
  rows.push_back({"no drop: the stroke ends before it turns",
                  fmt::format("{:.4f}", drop.drop.bottoming_probability)});
  return table_of(rows, {false, true});
}

std::string figure_words_of(const DiagnosedDrop& drop, const char* name) {
  const std::size_t f = figure_called(name);
  const auto& b = drop.drop.bands[f];
  const double k = drop.output.sections.words.scale[f];
  const std::string range = interval_words(k * b.lower, k * b.upper);
  const std::string unit = drop.output.sections.words.unit[f];
  if (range == "-") return fmt::format("{:.6g} {}", k * b.value, unit);
  return fmt::format("{} {} (95 %: {})",
                     report::rounded_to(k * b.value, 0.25 * k * (b.upper - b.lower)), unit, range);
}

std::string drop_sentence(const DiagnosedDrop& drop) {
  const DropSetup& setup = drop.output.sections.setup;
  return fmt::format("At touch-down with {:.4g} {}/s: {} {}, {} {}.", setup.conditions.sink_speed,
                     drop.length, drop.output.sections.words.label[figure_called("peak_load")],
                     figure_words_of(drop, "peak_load"),
                     drop.output.sections.words.label[figure_called("peak_stroke")],
                     figure_words_of(drop, "peak_stroke"));
}

double fastest_visited(const estimator::IdentifiedDamper& damper) {
  double fastest = 0.0;
  for (const auto& cell : damper.visited)
    fastest = std::max(fastest, std::fabs(cell.velocity));
  return fastest;
}

std::vector<std::string> validity(const Dossier& dossier) {
  std::vector<std::string> said = {
      "It serves acceptance after production or overhaul, growth and minor changes of a known "
      "gear, and the choice of the few drops that are worth making. It does not replace the drop "
      "of a new type.",
      "The damper is the one of the campaign: its charge, its oil and its temperature. With others "
      "it is another damper.",
      "The intervals hold the noise of the records. They do not hold an error of calibration: "
      "where a transducer reads 1 % too much, strokes and loads follow it.",
      "One damper was tested. How far two dampers of one type differ is not known from it."};
  if (dossier.drop == nullptr) return said;
  const DiagnosedDrop& drop = *dossier.drop;
  said.push_back(fmt::format(
      "{:.0f} % of the energy is absorbed at strokes and velocities that the campaign did not "
      "visit: "
      "it went up to {:.2g} {}/s, the drop goes up to {:.2g} {}/s. There the law of each effect is "
      "taken to go on as it was.",
      100.0 * drop.drop.extrapolated_energy_share, fastest_visited(drop.damper), drop.length,
      drop.drop.run.fastest, drop.length));
  said.push_back(prior_words(drop.priors));
  said.push_back(drop.output.sections.setup.tyre
                     ? "The tyre is a linear spring and damper with the numbers that were given."
                     : "Unless the model has a tyre there is none: the load is that of the strut.");
  said.emplace_back(
      "The strut stands upright. Spin-up drag, attitude, and side loads on the bearings are not in "
      "it.");
  return said;
}

// Quoted for a shell where it must be.
std::string quoted(const std::string& word) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./=-+,^:%@";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string out = "'";
  for (const char c : word)
    out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

std::string places_of(const DropOptions& options) {
  std::string words;
  for (const auto& place : options.campaigns)
    words += " " + quoted(place.string());
  if (!options.model.empty()) words += " --model " + quoted(options.model.string());
  return words;
}

std::string drop_words(const DropOptions& o) {
  std::string words;
  const auto number = [&](const char* option, const std::optional<double>& value) {
    if (value) words += fmt::format(" {} {}", option, *value);
  };
  const auto text = [&](const char* option, const std::string& value) {
    if (!value.empty()) words += fmt::format(" {} {}", option, quoted(value));
  };
  text("--rule", o.rule);
  text("--condition", o.condition);
  text("--weight", o.weight);
  text("--wing-loading", o.wing_loading);
  number("--sink-speed", o.sink_speed);
  number("--lift", o.lift);
  number("--mass", o.mass);
  number("--shaker-mass", o.shaker_mass);
  number("--tyre-stiffness", o.tyre_stiffness);
  number("--tyre-damping", o.tyre_damping);
  number("--unsprung-mass", o.unsprung_mass);
  text("--stroke-limit", o.stroke_limit);
  number("--piston-area", o.piston_area);
  for (const std::string& limit : o.limits)
    text("--limit", limit);
  if (o.discharge_spread > 0.0) number("--cd-spread", o.discharge_spread);
  if (o.index_spread > 0.0) number("--index-spread", o.index_spread);
  for (const auto& [option, ends] : {std::pair{"--charge", &o.charge}, std::pair{"--oil", &o.oil},
                                     std::pair{"--temperature", &o.temperature}}) {
    if (ends->size() == 1) words += fmt::format(" {}={}", option, (*ends)[0]);
    if (ends->size() == 2) words += fmt::format(" {} {},{}", option, (*ends)[0], (*ends)[1]);
  }
  number("--tested-temperature", o.tested_temperature);
  text("--measured", o.measured.string());
  if (o.join) words += " --join";
  number("--measured-sink-speed", o.measured_sink_speed);
  number("--measured-lift", o.measured_lift);
  number("--measured-mass", o.measured_mass);
  text("--measured-noise", o.measured_noise);
  if (o.duration != DropOptions().duration) words += fmt::format(" --duration {}", o.duration);
  return words;
}

}  // namespace

PageValues drop_values(const DiagnosedDrop& drop) {
  DropScene scene;
  scene.run = &drop.drop.run;
  scene.shares = &drop.output.sections.shares;
  scene.visited = &drop.damper.visited;
  scene.options.sink_speed = drop.output.sections.setup.conditions.sink_speed;
  scene.options.mass = drop.output.sections.setup.mass;
  scene.options.length_unit = drop.length;
  scene.options.band = &drop.drop.history;
  scene.options.joined = drop.joined ? &drop.joined->after.history : nullptr;
  scene.options.measured = drop.output.measured ? &*drop.output.measured : nullptr;
  PageValues sections = PageValues::array();
  for (const DropSection& section : drop_sections(drop.output.sections)) {
    PageValues rows = PageValues::array();
    for (const auto& [label, said] : section.rows)
      rows.push_back({{"label", label}, {"said", said}});
    sections.push_back({{"heading", section.heading}, {"rows", std::move(rows)}});
  }
  PageValues values = {{"drop_sentence", drop_sentence(drop)},
                       {"has_drop_warnings", !drop.drop.warnings.empty()},
                       {"drop_warnings", drop.drop.warnings},
                       {"drop_pictures", drop_pictures(scene)},
                       {"drop_figures", figures_table(drop)},
                       {"drop_sections", std::move(sections)},
                       {"drop_hypotheses", hypotheses_table(drop)}};
  const DropOutput& beside = drop.measured_fall ? drop.measured_fall->output : drop.output;
  if (beside.comparison) {
    PageValues measured = table_of(comparison_rows(*beside.comparison, beside.sections.words),
                                   {false, true, true, true, true, false});
    measured["band_sentences"] = band_sentences(*beside.comparison);
    measured["measured_at"] = fmt::format("It touched down with {:.4g} {}/s.",
                                          beside.sections.setup.conditions.sink_speed, drop.length);
    values["drop_measured"] = std::move(measured);
  }
  if (drop.joined) {
    PageValues joined = table_of(joined_rows(drop), {false, true, true, true, true, false});
    joined["joined_sentences"] = joined_sentences(drop);
    values["drop_joined"] = std::move(joined);
  }
  return values;
}

std::string drop_page(const DiagnosedDrop& drop, const report::TitleBlock& title) {
  PageValues values = drop_values(drop);
  values["alone"] = true;
  report::TitleBlock block = {{"model", drop.damper.hypotheses.front().model.name}};
  block.insert(block.begin(), title.begin(), title.end());
  const std::string heading =
      drop.damper.campaign.empty() ? "Drop of a damper" : "Drop: " + drop.damper.campaign;
  return report::render_page(heading, heading, block, "drop", values);
}

std::string dossier_page(const Dossier& dossier) {
  const Diagnosis& d = *dossier.diagnosis;
  PageValues values = {{"verdict", std::string(name(d.verdict))},
                       {"verdict_sentence", report::diagnosis_sentence(d)},
                       {"runs", runs_table(*dossier.opened)},
                       {"estimate_sentence", estimate_sentence(d)},
                       {"estimate", estimate_table(d)},
                       {"diagnosed", report::diagnosis_values(d)},
                       {"validity", validity(dossier)},
                       {"commands", dossier.commands}};
  if (dossier.drop != nullptr) values["dropped"] = drop_values(*dossier.drop);
  if (!dossier.no_drop.empty()) values["no_drop"] = PageValues::array({dossier.no_drop});
  report::TitleBlock block = {{"model", d.model}};
  block.insert(block.begin(), dossier.title.begin(), dossier.title.end());
  const std::string heading = d.campaign.empty() ? "Dossier of a damper" : d.campaign;
  return report::render_page(heading + ": dossier", heading, block, "dossier", values);
}

std::vector<std::string> dossier_commands(const ReportOptions& options) {
  const DropOptions& drop = options.drop;
  std::vector<std::string> commands;
  std::string campaigns;
  for (const auto& place : drop.campaigns)
    campaigns += " " + quoted(place.string());
  commands.push_back("shakerctl verify" + campaigns);
  const std::string places = places_of(drop), falls = drop_words(drop);
  commands.push_back("shakerctl estimate" + places);
  commands.push_back("shakerctl diagnose" + places + " --out diagnosis");
  if (!falls.empty())
    commands.push_back("shakerctl drop" + campaigns + " --diagnosis diagnosis" + falls);
  std::string own = "shakerctl report" + places + falls + " --out " + quoted(options.out.string());
  for (const auto& [option, value] :
       {std::pair{"--specimen", options.specimen}, std::pair{"--serial", options.serial},
        std::pair{"--rig-name", options.rig}, std::pair{"--operator", options.operator_name}}) {
    if (!value.empty()) own += fmt::format(" {} {}", option, quoted(value));
  }
  commands.push_back(own);
  return commands;
}

}  // namespace shaker::cli
