#include "report/diagnosis_document.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "report/text_table.hpp"

namespace shaker::report {
namespace {

using nlohmann::ordered_json;
using namespace estimator::diagnosis;

void put(ordered_json& object, const char* key, double value) {
  if (std::isfinite(value)) object[key] = value;
}
void put(ordered_json& object, const char* key, const std::optional<double>& value) {
  if (value) put(object, key, *value);
}

ordered_json numbers(const std::vector<double>& values) {
  // Six digits, because these numbers are for drawings.
  ordered_json list = ordered_json::array();
  for (const double v : values)
    list.push_back(std::isfinite(v) ? ordered_json(std::stod(fmt::format("{:.6g}", v)))
                                    : ordered_json());
  return list;
}

ordered_json parameters_json(const std::vector<estimator::ParameterEstimate>& parameters) {
  ordered_json list = ordered_json::array();
  for (const auto& p : parameters) {
    ordered_json entry{{"name", p.name}, {"effect", p.effect}, {"unit", p.unit}};
    put(entry, "value", p.value);
    put(entry, "standard_error", p.standard_error);
    if (std::isfinite(p.lower) && std::isfinite(p.upper)) entry["interval"] = {p.lower, p.upper};
    entry["fixed"] = p.fixed;
    entry["at_bound"] = p.at_bound;
    entry["determined"] = p.determined;
    list.push_back(std::move(entry));
  }
  return list;
}

ordered_json effects_json(const Diagnosis& d) {
  ordered_json list = ordered_json::array();
  for (const NamedEffect& e : d.effects) {
    ordered_json entry{{"name", e.name}, {"meaning", e.meaning}, {"formula", e.formula}};
    put(entry, "probability", e.probability);
    entry["parameters"] = parameters_json(e.parameters);
    entry["confusable_with"] = e.confusable_with;
    if (e.discriminating_run) {
      ordered_json split;
      put(split, "frequency_hz", e.discriminating_run->frequency_hz);
      put(split, "amplitude", e.discriminating_run->amplitude);
      put(split, "separation", e.discriminating_run->separation);
      if (!e.discriminating_run->channel.empty()) split["channel"] = e.discriminating_run->channel;
      entry["split_by"] = std::move(split);
    }
    entry["where"] = e.where;
    put(entry, "held_out_gain", e.held_out_gain);
    list.push_back(std::move(entry));
  }
  return list;
}

ordered_json kinds_json(const Diagnosis& d) {
  ordered_json list = ordered_json::array();
  for (const KindShare& kind : d.kinds) {
    ordered_json members = ordered_json::array();
    for (const KindShare::Member& m : kind.members)
      members.push_back({{"name", m.name}, {"probability", m.probability}});
    list.push_back(
        {{"name", kind.name}, {"probability", kind.probability}, {"effects", std::move(members)}});
  }
  return list;
}

ordered_json gap_json(const Gap& gap) {
  ordered_json entry;
  put(entry, "noise", gap.noise);
  put(entry, "noise_floor", gap.noise_floor);
  put(entry, "before", gap.before);
  put(entry, "after", gap.after);
  put(entry, "held_out_before", gap.held_out_before);
  put(entry, "held_out_after", gap.held_out_after);
  entry["unit"] = gap.unit;
  return entry;
}

ordered_json runs_json(const Diagnosis& d) {
  ordered_json list = ordered_json::array();
  for (const RunGap& r : d.runs) {
    ordered_json entry{{"name", r.name}, {"role", r.role == Role::fit ? "fit" : "held_out"}};
    put(entry, "frequency_hz", r.frequency_hz);
    put(entry, "amplitude", r.amplitude);
    entry["cycles"] = r.cycles;
    put(entry, "before", r.before);
    put(entry, "after", r.after);
    put(entry, "noise", r.noise);
    put(entry, "noise_floor", r.noise_floor);
    list.push_back(std::move(entry));
  }
  return list;
}

ordered_json ranking_json(const Diagnosis& d) {
  ordered_json list = ordered_json::array();
  for (const Ranked& r : d.ranking) {
    ordered_json entry{{"name", r.name}};
    put(entry, "probability", r.probability);
    put(entry, "gain", r.gain);
    put(entry, "gain_refitted", r.gain_refitted);
    put(entry, "cross_validated", r.cross_validated);
    put(entry, "hidden", r.hidden);
    if (!r.disqualified.empty()) entry["disqualified"] = r.disqualified;
    list.push_back(std::move(entry));
  }
  return list;
}

ordered_json not_tried_json(const Diagnosis& d) {
  ordered_json list = ordered_json::array();
  for (const NotTried& n : d.not_tried)
    list.push_back({{"name", n.name}, {"reason", n.reason}, {"failed", n.failed}});
  return list;
}

ordered_json bins_json(const std::vector<ForceBin>& bins) {
  ordered_json list = ordered_json::array();
  for (const ForceBin& bin : bins)
    list.push_back(numbers({bin.at, bin.before, bin.after}));
  return list;
}

ordered_json location_json(const Location& location) {
  ordered_json entry{{"words", location.words}};
  put(entry, "share", location.share);
  entry["over_stroke"] = bins_json(location.over_stroke);
  entry["over_velocity"] = bins_json(location.over_velocity);
  entry["over_phase"] = bins_json(location.over_phase);
  entry["share_of_harmonic"] = numbers(location.share_of_harmonic);
  return entry;
}

ordered_json remaining_json(const RemainingForce& force, const std::string& length_unit) {
  ordered_json entry{{"words", force.words}, {"unit", length_unit + "/s^2"}};
  put(entry, "share", force.share);
  put(entry, "stroke_step", force.stroke_step);
  put(entry, "velocity_step", force.velocity_step);
  entry["cells"] = ordered_json::array();
  for (const ForceCell& cell : force.cells)
    entry["cells"].push_back(
        numbers({cell.stroke, cell.velocity, cell.force, cell.standard_error, cell.time}));
  return entry;
}

ordered_json curves_json(const Diagnosis& d) {
  ordered_json list = ordered_json::array();
  for (const RunCurves& c : d.curves) {
    list.push_back({{"run", c.name},
                    {"measured", numbers(c.measured)},
                    {"before", numbers(c.before)},
                    {"after", numbers(c.after)},
                    {"stroke", numbers(c.stroke)},
                    {"velocity", numbers(c.velocity)},
                    {"velocity_before", numbers(c.velocity_before)},
                    {"velocity_after", numbers(c.velocity_after)},
                    {"force_before", numbers(c.force_before)},
                    {"force_after", numbers(c.force_after)}});
  }
  return list;
}

std::string size(double value, const std::string& unit) {
  if (unit == "m") return fmt::format("{:.4g} mm", 1e3 * value);
  return fmt::format("{:.4g} {}", value, unit);
}

// A named effect, or its kind where several of that kind may be it, with how sure that is.
std::string missing_words(const Diagnosis& d) {
  std::vector<std::string> words, told;
  for (const NamedEffect& e : d.effects) {
    const auto kind = std::find_if(d.kinds.begin(), d.kinds.end(), [&](const KindShare& k) {
      return std::any_of(k.members.begin(), k.members.end(),
                         [&](const KindShare::Member& m) { return m.name == e.name; });
    });
    if (kind == d.kinds.end())
      words.push_back(fmt::format("{}, probability {:.2f}", e.name, e.probability));
    else if (std::find(told.begin(), told.end(), kind->name) == told.end())
      words.push_back(kind_sentence(*kind));
    if (kind != d.kinds.end()) told.push_back(kind->name);
  }
  return fmt::format("{}", fmt::join(words, "; "));
}

// How much of the gap closes, on data that were not fitted where there are such.
std::string closed_words(const Diagnosis& d) {
  const bool held = d.gap.held_out_before && d.gap.held_out_after && *d.gap.held_out_before > 0.0;
  const double left =
      held ? *d.gap.held_out_after / *d.gap.held_out_before : d.gap.after / d.gap.before;
  if (!(left < 1.0)) return "that does not close the gap";
  return fmt::format("that closes {:.0f} % of the gap{}", 100.0 * (1.0 - left),
                     held ? " on data that were not fitted" : "");
}

std::string verdict_sentence(const Diagnosis& d) {
  switch (d.verdict) {
    case Verdict::adequate:
      return std::any_of(d.not_tried.begin(), d.not_tried.end(),
                         [](const NotTried& n) { return n.failed; })
                 ? "adequate: nothing is missing of what could be computed"
                 : "adequate: nothing is missing that these data could show";
    case Verdict::explained:
      if (d.effects.empty()) return "explained: the model leaves nothing but noise";
      return fmt::format("explained: missing is {}; {}, and nothing but noise is left",
                         missing_words(d), closed_words(d));
    default:
      if (d.effects.empty())
        return "unexplained: something is missing, and no effect of the catalogue explains it";
      return fmt::format(
          "unexplained: most likely missing is {}; {}, and no effect of the catalogue explains the "
          "rest",
          missing_words(d), closed_words(d));
  }
}

// Effects that share a reason stand together: those that may be missing first.
std::string not_tried_lines(const Diagnosis& d) {
  std::vector<std::pair<std::string, std::string>> groups;  // reason, names
  for (const bool failed : {true, false}) {
    for (const NotTried& n : d.not_tried) {
      if (n.failed != failed) continue;
      const auto known = std::find_if(groups.begin(), groups.end(),
                                      [&](const auto& group) { return group.first == n.reason; });
      if (known == groups.end())
        groups.emplace_back(n.reason, n.name);
      else
        known->second += ", " + n.name;
    }
  }
  std::string text;
  for (const auto& [reason, names] : groups)
    text += fmt::format("not tried: {}: {}\n", names, reason);
  return text.empty() ? text : "\n" + text;
}

std::string effect_lines(const NamedEffect& e, const std::string& driven) {
  std::string text = fmt::format("\n{}  probability {:.3f}\n", e.name, e.probability);
  if (!e.meaning.empty()) text += fmt::format("  {}\n", e.meaning);
  text += fmt::format("  where: {}\n", e.where);
  for (const auto& p : e.parameters)
    text += fmt::format(
        "  {} = {} {} (95 %: {} to {})\n", p.name, with_error(p.value, p.standard_error), p.unit,
        rounded_to(p.lower, p.standard_error), rounded_to(p.upper, p.standard_error));
  if (!e.confusable_with.empty())
    text += fmt::format("  this campaign cannot tell it from: {}\n",
                        fmt::join(e.confusable_with, ", "));
  if (e.discriminating_run && !e.discriminating_run->channel.empty())
    text += fmt::format("  what would: the channel {}\n", e.discriminating_run->channel);
  else if (e.discriminating_run)
    text += fmt::format(
        "  what would: a run at {:.3g} Hz with amplitude {} ({:.1f} standard "
        "errors)\n",
        e.discriminating_run->frequency_hz, size(e.discriminating_run->amplitude, driven),
        e.discriminating_run->separation);
  if (e.held_out_gain)
    text += fmt::format("  closes {:.0f} % of the gap on runs that were not fitted\n",
                        100.0 * *e.held_out_gain);
  return text;
}

}  // namespace

std::string kind_sentence(const KindShare& kind) {
  std::vector<std::string> members;
  for (const KindShare::Member& m : kind.members)
    members.push_back(fmt::format("{} {:.2f}", m.name, m.probability));
  return fmt::format("{}, probability {:.2f} ({})", kind.name, kind.probability,
                     fmt::join(members, ", "));
}

std::string diagnosis_json(const Diagnosis& d) {
  ordered_json document{{"format", "shaker-diagnosis/1"},
                        {"verdict", name(d.verdict)},
                        {"campaign", d.campaign},
                        {"model", d.model}};
  document["effects"] = effects_json(d);
  if (!d.kinds.empty()) document["kinds"] = kinds_json(d);
  document["gap"] = gap_json(d.gap);
  document["runs"] = runs_json(d);
  document["ranking"] = ranking_json(d);
  document["not_tried"] = not_tried_json(d);
  document["parameters_before"] = parameters_json(d.parameters_before);
  document["parameters_after"] = parameters_json(d.parameters_after);
  document["false_alarm_rate"] = d.false_alarm_rate;
  ordered_json test;
  put(test, "probability_before", d.probability_before);
  put(test, "probability_after", d.probability_after);
  put(test, "chi_squared_before", d.chi_squared_before);
  put(test, "chi_squared_after", d.chi_squared_after);
  test["observations"] = d.observations;
  document["test"] = std::move(test);
  document["location"] = location_json(d.location);
  if (d.remaining)
    document["remaining_force"] = remaining_json(*d.remaining, d.improved.length_unit);
  document["curves"] = curves_json(d);
  document["warnings"] = d.warnings;
  return document.dump(2, ' ', false, ordered_json::error_handler_t::replace);
}

std::string diagnosis_table(const Diagnosis& d) {
  std::string text = verdict_sentence(d) + "\n";
  text += fmt::format(
      "gap {} before, {} after; noise floor {} (noise alone stays below it in 95 of 100 campaigns; "
      "{} are expected of it)\n",
      size(d.gap.before, d.gap.unit), size(d.gap.after, d.gap.unit),
      size(d.gap.noise_floor, d.gap.unit), size(d.gap.noise, d.gap.unit));
  if (d.gap.held_out_before && d.gap.held_out_after)
    text += fmt::format("held out: {} before, {} after\n", size(*d.gap.held_out_before, d.gap.unit),
                        size(*d.gap.held_out_after, d.gap.unit));
  if (d.verdict != Verdict::adequate) text += d.location.words + "\n";
  if (d.remaining) text += d.remaining->words + "\n";
  const std::string& length = d.improved.length_unit;
  const bool imposed = d.gap.unit != length;  // the motion is imposed, and forces are compared
  for (const NamedEffect& e : d.effects)
    text += effect_lines(e, imposed ? length : length + "/s^2");
  if (!d.warnings.empty()) text += "\n";
  for (const std::string& warning : d.warnings)
    text += "note: " + warning + "\n";
  return text + not_tried_lines(d);
}

}  // namespace shaker::report
