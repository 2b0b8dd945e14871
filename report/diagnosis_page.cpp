#include "report/diagnosis_page.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "report/diagnosis_document.hpp"
#include "report/diagnosis_pictures.hpp"
#include "report/text_table.hpp"

namespace shaker::report {
namespace {

using namespace estimator::diagnosis;
using estimator::ParameterEstimate;

constexpr std::size_t kRunsDrawn = 2;  // in full; the others are folded

std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{:.4g}", value) : "-";
}

std::string names_of(const Diagnosis& d) {
  std::vector<std::string> names;
  for (const auto& effect : d.effects)
    names.push_back(effect.name);
  return fmt::format("{}", fmt::join(names, " and "));
}

using Cells = std::vector<std::pair<std::string, bool>>;  // text, and whether it is a number

PageValues cells(const Cells& row) {
  PageValues made = PageValues::array();
  for (const auto& [text, right] : row)
    made.push_back(page_cell(text, right));
  return made;
}

std::string parameter_words(const ParameterEstimate& p) {
  if (!p.determined) return fmt::format("{}: not determined by this campaign", p.name);
  std::string text = fmt::format("{} = {}{}", p.name, with_error(p.value, p.standard_error),
                                 p.unit.empty() || p.unit == "-" ? "" : " " + p.unit);
  if (std::isfinite(p.lower) && std::isfinite(p.upper) && !p.fixed)
    text += fmt::format(" (95 %: {} to {})", rounded_to(p.lower, p.standard_error),
                        rounded_to(p.upper, p.standard_error));
  return p.fixed ? text + ", fixed" : text;
}

PageValues effect_values(const NamedEffect& effect, const Shown& driven) {
  PageValues facts = PageValues::array();
  const auto add = [&](const std::string& what, const std::string& said) {
    facts.push_back({{"what", what}, {"said", said}});
  };
  for (const auto& parameter : effect.parameters)
    add("estimate", parameter_words(parameter));
  add("probability", fmt::format("{:.3f}", effect.probability));
  if (!effect.where.empty()) add("where", effect.where);
  if (effect.held_out_gain)
    add("held-out runs",
        fmt::format("{:.0f} % of their gap closes", 100.0 * *effect.held_out_gain));
  add("cannot be told from", effect.confusable_with.empty()
                                 ? "nothing else in the catalogue"
                                 : fmt::format("{}", fmt::join(effect.confusable_with, ", ")));
  if (const auto& split = effect.discriminating_run) {
    add("what would tell", split->channel.empty()
                               ? fmt::format("one more run at {} Hz with an amplitude of {} {}",
                                             number(split->frequency_hz),
                                             number(split->amplitude * driven.factor), driven.unit)
                               : fmt::format("the channel {}", split->channel));
  }
  return {{"name", effect.name},
          {"meaning", effect.meaning},
          {"formula", effect.formula},
          {"facts", std::move(facts)}};
}

PageValues gap_table(const Diagnosis& d) {
  const Shown shown = shown_length(d.gap.unit), driven = shown_amplitude(d);
  const bool after = !d.effects.empty();
  PageValues rows = PageValues::array();
  for (const RunGap& run : d.runs) {
    rows.push_back(cells({{run.name, false},
                          {run.role == Role::fit ? "fitted" : "held out", false},
                          {number(run.frequency_hz), true},
                          {number(run.amplitude * driven.factor), true},
                          {std::to_string(run.cycles), true},
                          {number(run.noise_floor * shown.factor), true},
                          {number(run.before * shown.factor), true},
                          {after ? number(run.after * shown.factor) : "", true}}));
  }
  return page_table(cells({{"run", false},
                           {"role", false},
                           {"frequency, Hz", true},
                           {"amplitude, " + driven.unit, true},
                           {"cycles", true},
                           {"noise floor, " + shown.unit, true},
                           {"gap before, " + shown.unit, true},
                           {after ? "gap after, " + shown.unit : "", true}}),
                    std::move(rows));
}

PageValues bent_table(const Diagnosis& d) {
  PageValues rows = PageValues::array();
  for (const auto& before : d.parameters_before) {
    const auto found = std::ranges::find_if(d.parameters_after, [&](const auto& p) {
      return p.name == before.name && p.effect == before.effect;
    });
    Cells row = {{before.name, false},
                 {before.unit, false},
                 {with_error(before.value, before.standard_error), true}};
    if (found != d.parameters_after.end() && !d.effects.empty()) {
      const double bent = 100.0 * (before.value / found->value - 1.0);
      row.emplace_back(with_error(found->value, found->standard_error), true);
      row.emplace_back(std::isfinite(bent) ? fmt::format("{:+.1f} %", bent) : "-", true);
    } else {
      row.insert(row.end(), 2, {"", false});
    }
    rows.push_back(cells(row));
  }
  return page_table(cells({{"parameter", false},
                           {"unit", false},
                           {"base model", true},
                           {d.effects.empty() ? "" : "with what was missing", true},
                           {d.effects.empty() ? "" : "bent by", true}}),
                    std::move(rows));
}

PageValues ranking_table(const Diagnosis& d) {
  PageValues rows = PageValues::array();
  for (const Ranked& row : d.ranking) {
    rows.push_back(
        cells({{row.name, false},
               {number(row.gain), true},
               {fmt::format("{:.0f} %", 100.0 * row.hidden), true},
               {row.gain_refitted ? number(*row.gain_refitted) : "", true},
               {row.probability > 0.0 ? fmt::format("{:.3f}", row.probability) : "", true},
               {row.disqualified, false}}));
  }
  return page_table(cells({{"effect", false},
                           {"gain in chi-squared", true},
                           {"imitated by the parameters", true},
                           {"refitted", true},
                           {"probability", true},
                           {"", false}}),
                    std::move(rows));
}

PageValues not_tried_table(const Diagnosis& d) {
  PageValues rows = PageValues::array();
  for (const bool failed : {true, false}) {
    for (const NotTried& n : d.not_tried) {
      if (n.failed == failed) rows.push_back(cells({{n.name, false}, {n.reason, false}}));
    }
  }
  return page_table(cells({{"effect", false}, {"reason", false}}), std::move(rows));
}

std::string failed_words(const Diagnosis& d) {
  std::string names;
  for (const NotTried& n : d.not_tried) {
    if (n.failed) names += (names.empty() ? "" : ", ") + n.name;
  }
  return names.empty() ? names : " But what could not be computed may be: " + names + ".";
}

// The runs with the largest gaps first.
std::vector<const RunCurves*> worst_first(const Diagnosis& d) {
  std::vector<const RunCurves*> runs;
  for (const RunCurves& run : d.curves)
    runs.push_back(&run);
  const auto gap = [&](const RunCurves* curves) {
    for (const RunGap& run : d.runs)
      if (run.name == curves->name) return run.before / run.noise_floor;
    return 0.0;
  };
  std::ranges::stable_sort(runs, [&](auto* a, auto* b) { return gap(a) > gap(b); });
  return runs;
}

void add_run_pictures(const Diagnosis& d, PageValues& values) {
  std::string drawn, folded;
  const auto runs = worst_first(d);
  for (std::size_t i = 0; i < runs.size(); ++i)
    (i < kRunsDrawn ? drawn : folded) += cycle_picture(d, *runs[i]) + phase_plane(d, *runs[i]);
  values["worst_runs"] = drawn;
  if (!folded.empty()) values["others"] = {{"pictures", folded}};
}

PageValues force_values(const Diagnosis& d) {
  PageValues words = PageValues::array();
  if (!d.location.words.empty()) words.push_back(d.location.words);
  if (d.remaining) words.push_back(d.remaining->words);
  std::string pictures = force_over_velocity(d) + force_over_stroke(d) + force_map(d, false);
  if (d.verdict == Verdict::unexplained && !d.effects.empty()) pictures += force_map(d, true);
  pictures += remaining_map(d);
  const auto runs = worst_first(d);
  for (std::size_t i = 0; i < std::min(runs.size(), kRunsDrawn); ++i)
    pictures += force_along_motion(d, *runs[i]);
  return {{"words", std::move(words)},
          {"pictures", pictures + harmonics_bars(d) + force_over_phase(d)}};
}

}  // namespace

std::string diagnosis_sentence(const Diagnosis& d) {
  const double before = d.gap.before / d.gap.noise_floor, after = d.gap.after / d.gap.noise_floor;
  switch (d.verdict) {
    case Verdict::adequate:
      return fmt::format(
          "Nothing is missing: the gap is {:.2f} times the noise floor, and noise alone makes one "
          "like it with probability {:.2g}.{}",
          before, d.probability_before, failed_words(d));
    case Verdict::explained:
      // The quantisation step is read from the records and already part of the noise floor.
      if (d.effects.size() == 1 && d.effects[0].name == "sensor_quantisation")
        return fmt::format(
            "{} is all that is missing: with its steps in the noise floor the gap is {:.2f} times "
            "that, and noise alone makes one like it with probability {:.2g}.",
            names_of(d), after, d.probability_after);
      return fmt::format(
          "{} {} missing: with {} the gap shrinks from {:.3g} to {:.3g} times the noise floor.",
          names_of(d), d.effects.size() == 1 ? "was" : "were",
          d.effects.size() == 1 ? "it" : "them", before, after);
    case Verdict::unexplained:
      break;
  }
  if (d.effects.empty()) {
    return fmt::format(
        "Something is missing that no effect of the catalogue explains: the gap is {:.3g} times "
        "the "
        "noise floor.",
        before);
  }
  return fmt::format(
      "Something is missing that the catalogue does not explain: {} helps most, but a gap of "
      "{:.3g} "
      "times the noise floor is left of {:.3g}.",
      names_of(d), after, before);
}

PageValues diagnosis_values(const Diagnosis& d) {
  PageValues effects = PageValues::array();
  for (const NamedEffect& effect : d.effects)
    effects.push_back(effect_values(effect, shown_amplitude(d)));
  std::vector<std::string> kinds;
  for (const KindShare& kind : d.kinds)
    kinds.push_back(kind_sentence(kind));
  PageValues values = {{"verdict", std::string(name(d.verdict))},
                       {"kinds", std::move(kinds)},
                       {"sentence", diagnosis_sentence(d)},
                       {"warned", !d.warnings.empty()},
                       {"warnings", d.warnings},
                       {"effects", std::move(effects)},
                       {"gap_bars", gap_bars(d)},
                       {"gaps", gap_table(d)},
                       {"parameters", bent_table(d)},
                       {"false_alarms", fmt::format("{:.2g}", 100.0 * d.false_alarm_rate)}};
  add_run_pictures(d, values);
  if (d.verdict != Verdict::adequate) values["missing_force"] = force_values(d);
  if (!d.ranking.empty()) values["ranking"] = ranking_table(d);
  if (!d.not_tried.empty()) values["not_tried"] = not_tried_table(d);
  return values;
}

std::string diagnosis_page(const Diagnosis& d, const TitleBlock& title) {
  TitleBlock block = {{"model", d.model}};
  block.insert(block.end(), title.begin(), title.end());
  return render_page(fmt::format("{}: {}", d.campaign, name(d.verdict)),
                     d.campaign.empty() ? "Diagnosis of a campaign" : d.campaign, block,
                     "diagnosis", diagnosis_values(d));
}

}  // namespace shaker::report
