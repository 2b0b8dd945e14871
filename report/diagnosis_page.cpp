#include "report/diagnosis_page.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "report/diagnosis_pictures.hpp"
#include "report/plot/plot.hpp"
#include "report/text_table.hpp"

namespace shaker::report {
namespace {

using namespace estimator::discrepancy;
using estimator::ParameterEstimate;

constexpr std::size_t kRunsDrawn = 2;  // in full; the others are folded

constexpr std::string_view kStyle = R"(
body{font:15px/1.5 system-ui,"DejaVu Sans",sans-serif;color:#222;background:#fff;max-width:1180px;margin:2em auto;padding:0 1.2em}
h1{font-size:1.5em;margin:0 0 .2em}h2{font-size:1.15em;margin:1.8em 0 .5em}
.verdict{border-left:6px solid;padding:.7em 1em;margin:1em 0;font-size:1.1em}
.adequate{border-color:#009e73;background:#eaf6f2}.explained{border-color:#0072b2;background:#e9f2f8}.unexplained{border-color:#d55e00;background:#fcf0e8}
table{border-collapse:collapse;margin:.5em 0}th,td{padding:.25em .8em;text-align:left;border-bottom:1px solid #ddd;vertical-align:top}
th{border-bottom:2px solid #888;font-weight:600}td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}
.pictures{display:flex;flex-wrap:wrap;gap:1em}.note{color:#555}code{font-size:.95em}
.title th,.title td{padding:0 1em 0 0;border:0;color:#555}
details{margin:.6em 0}summary{cursor:pointer}
@media print{body{margin:0;max-width:none;font-size:11px}.pictures svg{width:48%;height:auto}h2,table,svg{break-inside:avoid}details::details-content{content-visibility:visible}}
)";

std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{:.4g}", value) : "-";
}

std::string names_of(const Diagnosis& d) {
  std::vector<std::string> names;
  for (const auto& effect : d.effects)
    names.push_back(effect.name);
  return fmt::format("{}", fmt::join(names, " and "));
}

std::string cell(const std::string& text, bool right = false) {
  return fmt::format("<td{}>{}</td>", right ? " class=\"n\"" : "", escaped(text));
}

std::string head(const std::vector<std::pair<std::string, bool>>& columns) {
  std::string row = "<tr>";
  for (const auto& [text, right] : columns)
    row += fmt::format("<th{}>{}</th>", right ? " class=\"n\"" : "", escaped(text));
  return row + "</tr>\n";
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

std::string title_table(const Diagnosis& d, const TitleBlock& title) {
  std::string text = "<table class=\"title\">\n";
  const auto row = [&](const std::string& label, const std::string& said) {
    if (said.empty()) return;
    text += fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", escaped(label), escaped(said));
  };
  row("model", d.model);
  for (const auto& [label, said] : title)
    row(label, said);
  return text + "</table>\n";
}

std::string effect_section(const NamedEffect& effect, const Shown& driven) {
  std::string text =
      fmt::format("<h2><code>{}</code>: {}</h2>\n<p><code>{}</code></p>\n<table>\n",
                  escaped(effect.name), escaped(effect.meaning), escaped(effect.formula));
  const auto row = [&](const std::string& what, const std::string& said) {
    text += fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", escaped(what), escaped(said));
  };
  for (const auto& parameter : effect.parameters)
    row("estimate", parameter_words(parameter));
  row("probability", fmt::format("{:.3f}", effect.probability));
  if (!effect.where.empty()) row("where", effect.where);
  if (effect.held_out_gain)
    row("held-out runs",
        fmt::format("{:.0f} % of their gap closes", 100.0 * *effect.held_out_gain));
  if (effect.confusable_with.empty()) {
    row("cannot be told from", "nothing else in the catalogue");
  } else {
    row("cannot be told from", fmt::format("{}", fmt::join(effect.confusable_with, ", ")));
  }
  if (const auto& split = effect.split_by) {
    row("what would tell", split->channel.empty()
                               ? fmt::format("one more run at {} Hz with an amplitude of {} {}",
                                             number(split->frequency_hz),
                                             number(split->amplitude * driven.factor), driven.unit)
                               : fmt::format("the channel {}", split->channel));
  }
  return text + "</table>\n";
}

std::string gap_table(const Diagnosis& d) {
  const Shown shown = shown_length(d.gap.unit), driven = shown_amplitude(d);
  const bool after = !d.effects.empty();
  std::string text = "<table>\n" + head({{"run", false},
                                         {"role", false},
                                         {"frequency, Hz", true},
                                         {"amplitude, " + driven.unit, true},
                                         {"cycles", true},
                                         {"noise floor, " + shown.unit, true},
                                         {"gap before, " + shown.unit, true},
                                         {after ? "gap after, " + shown.unit : "", true}});
  for (const RunGap& run : d.runs) {
    text += "<tr>" + cell(run.name) + cell(run.role == Role::fit ? "fitted" : "held out") +
            cell(number(run.frequency_hz), true) +
            cell(number(run.amplitude * driven.factor), true) +
            cell(std::to_string(run.cycles), true) +
            cell(number(run.noise_floor * shown.factor), true) +
            cell(number(run.before * shown.factor), true) +
            cell(after ? number(run.after * shown.factor) : "", true) + "</tr>\n";
  }
  return text + "</table>\n";
}

std::string bent_table(const Diagnosis& d) {
  std::string text = "<table>\n" + head({{"parameter", false},
                                         {"unit", false},
                                         {"base model", true},
                                         {d.effects.empty() ? "" : "with what was missing", true},
                                         {d.effects.empty() ? "" : "bent by", true}});
  for (const auto& before : d.parameters_before) {
    const auto found = std::ranges::find_if(d.parameters_after, [&](const auto& p) {
      return p.name == before.name && p.effect == before.effect;
    });
    text += "<tr>" + cell(before.name) + cell(before.unit) +
            cell(with_error(before.value, before.standard_error), true);
    if (found != d.parameters_after.end() && !d.effects.empty()) {
      const double bent = 100.0 * (before.value / found->value - 1.0);
      text += cell(with_error(found->value, found->standard_error), true) +
              cell(std::isfinite(bent) ? fmt::format("{:+.1f} %", bent) : "-", true);
    } else {
      text += "<td></td><td></td>";
    }
    text += "</tr>\n";
  }
  return text + "</table>\n";
}

std::string ranking_table(const Diagnosis& d) {
  std::string text = "<table>\n" + head({{"effect", false},
                                         {"gain in chi-squared", true},
                                         {"imitated by the parameters", true},
                                         {"refitted", true},
                                         {"probability", true},
                                         {"", false}});
  for (const Ranked& row : d.ranking) {
    text += "<tr>" + cell(row.name) + cell(number(row.gain), true) +
            cell(fmt::format("{:.0f} %", 100.0 * row.hidden), true) +
            cell(row.gain_refitted ? number(*row.gain_refitted) : "", true) +
            cell(row.probability > 0.0 ? fmt::format("{:.3f}", row.probability) : "", true) +
            cell(row.disqualified) + "</tr>\n";
  }
  return text + "</table>\n";
}

std::string not_tried_table(const Diagnosis& d) {
  std::string text = "<table>\n" + head({{"effect", false}, {"reason", false}});
  for (const bool failed : {true, false}) {
    for (const NotTried& n : d.not_tried) {
      if (n.failed == failed) text += "<tr>" + cell(n.name) + cell(n.reason) + "</tr>\n";
    }
  }
  return text + "</table>\n";
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

std::string run_pictures(const Diagnosis& d) {
  std::string text = "<div class=\"pictures\">\n", folded;
  const auto runs = worst_first(d);
  for (std::size_t i = 0; i < runs.size(); ++i)
    (i < kRunsDrawn ? text : folded) += cycle_picture(d, *runs[i]) + phase_plane(d, *runs[i]);
  text += "</div>\n";
  if (folded.empty()) return text;
  return text + "<details><summary>The other runs</summary><div class=\"pictures\">\n" + folded +
         "</div></details>\n";
}

std::string force_section(const Diagnosis& d) {
  std::string text = "<h2>Where the missing force lies</h2>\n";
  if (!d.location.words.empty()) text += fmt::format("<p>{}</p>\n", escaped(d.location.words));
  if (d.remaining) text += fmt::format("<p>{}</p>\n", escaped(d.remaining->words));
  text += "<div class=\"pictures\">\n" + force_over_velocity(d) + force_over_stroke(d) +
          force_map(d, false);
  if (d.verdict == Verdict::unexplained && !d.effects.empty()) text += force_map(d, true);
  text += remaining_map(d);
  const auto runs = worst_first(d);
  for (std::size_t i = 0; i < std::min(runs.size(), kRunsDrawn); ++i)
    text += force_along_motion(d, *runs[i]);
  return text + harmonics_bars(d) + force_over_phase(d) + "</div>\n";
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

std::string diagnosis_page(const Diagnosis& d, const TitleBlock& title) {
  std::string page = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width\"><title>{}: {}</title>"
      "<style>{}{}</style></head><body>\n<h1>{}</h1>\n{}"
      "<p class=\"verdict {}\">{}</p>\n",
      escaped(d.campaign), name(d.verdict), kStyle, plot_style(),
      escaped(d.campaign.empty() ? "Diagnosis of a campaign" : d.campaign), title_table(d, title),
      name(d.verdict), escaped(diagnosis_sentence(d)));
  if (!d.warnings.empty()) {
    page += "<ul>\n";
    for (const auto& warning : d.warnings)
      page += fmt::format("<li>{}</li>\n", escaped(warning));
    page += "</ul>\n";
  }
  for (const NamedEffect& effect : d.effects)
    page += effect_section(effect, shown_amplitude(d));
  page += "<h2>The gap, run by run</h2>\n<div class=\"pictures\">" + gap_bars(d) + "</div>\n" +
          gap_table(d);
  page += "<h2>Measured and simulated</h2>\n" + run_pictures(d);
  if (d.verdict != Verdict::adequate) page += force_section(d);
  page += "<h2>The parameters</h2>\n" + bent_table(d);
  if (!d.ranking.empty()) {
    page +=
        "<h2>What was weighed</h2>\n<p class=\"note\">Every effect of the catalogue, by how much "
        "of "
        "the gap its signature explains that the model's parameters cannot imitate.</p>\n" +
        ranking_table(d);
  }
  if (!d.not_tried.empty()) page += "<h2>What was not tried</h2>\n" + not_tried_table(d);
  page += fmt::format(
      "<p class=\"note\">Gaps are root mean squares over the cycle; noise alone stays below "
      "the noise floor in 95 of 100 such campaigns, after as many parameters have been fitted to "
      "it. False alarms over the whole catalogue: "
      "{:.2g} %.</p>\n</body></html>\n",
      100.0 * d.false_alarm_rate);
  return page;
}

}  // namespace shaker::report
