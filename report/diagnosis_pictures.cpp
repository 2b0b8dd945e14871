#include "report/diagnosis_pictures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "report/plot/plot.hpp"

namespace shaker::report {
namespace {

using estimator::diagnosis::ForceBin;

constexpr int kCells = 24;  // of a map, in each direction

bool has_after(const Diagnosis& diagnosis) {
  return !diagnosis.effects.empty();
}

std::string with_names(const Diagnosis& diagnosis) {
  std::string names = "with";
  for (const auto& effect : diagnosis.effects)
    names += " " + effect.name;
  return names;
}

std::vector<double> scaled(const std::vector<double>& values, double factor) {
  std::vector<double> out(values);
  for (double& value : out)
    value *= factor;
  return out;
}

// Closes the drawing of a period: repeats the first point at the end.
std::vector<double> closed(std::vector<double> values) {
  if (!values.empty()) values.push_back(values.front());
  return values;
}

std::vector<double> phases(std::size_t n) {
  std::vector<double> tau(n);
  for (std::size_t i = 0; i < n; ++i)
    tau[i] = static_cast<double>(i) / static_cast<double>(n - 1);
  return tau;
}

std::string force_picture(const Diagnosis& diagnosis, const std::vector<ForceBin>& bins,
                          const std::string& title, const std::string& axis, double factor) {
  if (bins.empty()) return {};
  Plot plot;
  plot.title = title;
  plot.x.label = axis;
  plot.y.label = fmt::format("missing force, {}/s²", diagnosis.improved.length_unit);
  Curve before{"base model", {}, {}, Ink::second, Stroke::line};
  Curve after{with_names(diagnosis), {}, {}, Ink::first, Stroke::line};
  for (const ForceBin& bin : bins) {
    before.x.push_back(bin.at * factor);
    before.y.push_back(bin.before);
    after.x.push_back(bin.at * factor);
    after.y.push_back(bin.after);
  }
  plot.curves.push_back(std::move(before));
  if (has_after(diagnosis)) plot.curves.push_back(std::move(after));
  plot.marks.push_back({"", 0.0, false});
  return to_svg(plot);
}

struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void take(const std::vector<double>& values, double factor) {
    for (const double value : values) {
      low = std::min(low, value * factor);
      high = std::max(high, value * factor);
    }
  }
  std::vector<double> edges() const {
    std::vector<double> all(kCells + 1);
    for (int i = 0; i <= kCells; ++i)
      all[static_cast<std::size_t>(i)] = low + (high - low) * i / kCells;
    return all;
  }
  std::size_t cell(double value) const {
    const int i = static_cast<int>((value - low) / (high - low) * kCells);
    return static_cast<std::size_t>(std::clamp(i, 0, kCells - 1));
  }
};

}  // namespace

Shown shown_length(const std::string& unit) {
  if (unit == "m") return {1e3, "mm"};
  return {1.0, unit};
}

Shown shown_amplitude(const Diagnosis& diagnosis) {
  const std::string& length = diagnosis.improved.length_unit;
  const bool imposed = diagnosis.gap.unit != length;  // then forces are compared
  return imposed ? shown_length(length) : Shown{1.0, length + "/s²"};
}

std::string gap_bars(const Diagnosis& diagnosis) {
  Bars bars;
  bars.title = "Gap between model and measurement, over the noise floor (*: held out)";
  bars.y = {"gap / noise floor", 0.5, {}, true};
  bars.marks.push_back({"noise floor", 1.0, false});
  bars.series = {"base model"};
  bars.inks = {Ink::second, Ink::first};  // the same as in the curves
  bars.values.resize(1);
  if (has_after(diagnosis)) {
    bars.series.push_back(with_names(diagnosis));
    bars.values.resize(2);
  }
  for (const auto& run : diagnosis.runs) {
    const bool held = run.role == estimator::diagnosis::Role::held_out;
    bars.labels.push_back(run.name + (held ? "*" : ""));
    bars.values[0].push_back(run.before / run.noise_floor);
    if (bars.values.size() > 1) bars.values[1].push_back(run.after / run.noise_floor);
  }
  bars.width = std::max(560, 90 * static_cast<int>(bars.labels.size()));
  return bars.labels.empty() ? std::string() : to_svg(bars);
}

std::string cycle_picture(const Diagnosis& diagnosis, const RunCurves& run) {
  const Shown shown = shown_length(diagnosis.gap.unit);
  Plot plot;
  plot.title = fmt::format("Run {}: one cycle", run.name);
  plot.x = {"cyclic time, periods", 0.0, 1.0, false};
  plot.y.label = fmt::format("response, {}", shown.unit);
  // A record without a period: a section of it over time.
  const bool record = run.seconds > 0.0;
  if (record) {
    plot.title = fmt::format("Run {}: where it moves fastest", run.name);
    plot.x = {"time, s", run.from, run.from + run.seconds, false};
  }
  const auto add = [&](const std::string& name, const std::vector<double>& y, Ink ink, Stroke how) {
    if (y.empty()) return;
    if (record) {
      std::vector<double> t;
      for (std::size_t i = 0; i < y.size(); ++i)
        t.push_back(run.from +
                    run.seconds * static_cast<double>(i) / static_cast<double>(y.size()));
      plot.curves.push_back({name, t, scaled(y, shown.factor), ink, how});
      return;
    }
    const auto whole = closed(scaled(y, shown.factor));
    plot.curves.push_back({name, phases(whole.size()), whole, ink, how});
  };
  add("measured", run.measured, Ink::quiet, Stroke::points);
  add("base model", run.before, Ink::second, Stroke::dashed);
  if (has_after(diagnosis)) add(with_names(diagnosis), run.after, Ink::first, Stroke::line);
  return to_svg(plot);
}

std::string phase_plane(const Diagnosis& diagnosis, const RunCurves& run) {
  if (run.velocity_before.empty() || run.velocity.size() != run.measured.size()) return {};
  const Shown shown = shown_length(diagnosis.improved.length_unit);
  Plot plot;
  plot.title = fmt::format("Run {}: phase plane", run.name);
  plot.x.label = fmt::format("stroke, {}", shown.unit);
  plot.y.label = fmt::format("velocity, {}/s", shown.unit);
  const auto add = [&](const std::string& name, const std::vector<double>& stroke,
                       const std::vector<double>& velocity, Ink ink, Stroke how) {
    plot.curves.push_back({name, closed(scaled(stroke, shown.factor)),
                           closed(scaled(velocity, shown.factor)), ink, how});
  };
  add("measured", run.measured, run.velocity, Ink::quiet, Stroke::points);
  add("base model", run.before, run.velocity_before, Ink::second, Stroke::dashed);
  if (has_after(diagnosis))
    add(with_names(diagnosis), run.after, run.velocity_after, Ink::first, Stroke::line);
  return to_svg(plot);
}

std::string force_along_motion(const Diagnosis& diagnosis, const RunCurves& run) {
  if (run.velocity.empty() || run.force_before.empty()) return {};
  const Shown shown = shown_length(diagnosis.improved.length_unit);
  Plot plot;
  plot.title = fmt::format("Run {}: missing force along the motion", run.name);
  plot.x.label = fmt::format("velocity, {}/s", shown.unit);
  plot.y.label = fmt::format("missing force, {}/s²", diagnosis.improved.length_unit);
  const auto velocity = closed(scaled(run.velocity, shown.factor));
  plot.curves.push_back(
      {"base model", velocity, closed(run.force_before), Ink::second, Stroke::line});
  if (has_after(diagnosis) && !run.force_after.empty()) {
    plot.curves.push_back(
        {with_names(diagnosis), velocity, closed(run.force_after), Ink::first, Stroke::line});
  }
  plot.marks.push_back({"", 0.0, false});
  return to_svg(plot);
}

std::string force_over_stroke(const Diagnosis& diagnosis) {
  const Shown shown = shown_length(diagnosis.improved.length_unit);
  return force_picture(diagnosis, diagnosis.location.over_stroke, "Missing force over the stroke",
                       fmt::format("stroke, {}", shown.unit), shown.factor);
}

std::string force_over_velocity(const Diagnosis& diagnosis) {
  const Shown shown = shown_length(diagnosis.improved.length_unit);
  return force_picture(diagnosis, diagnosis.location.over_velocity,
                       "Missing force over the velocity", fmt::format("velocity, {}/s", shown.unit),
                       shown.factor);
}

std::string force_over_phase(const Diagnosis& diagnosis) {
  return force_picture(diagnosis, diagnosis.location.over_phase, "Missing force over the cycle",
                       "cyclic time, periods", 1.0);
}

std::string force_map(const Diagnosis& diagnosis, bool after) {
  const Shown shown = shown_length(diagnosis.improved.length_unit);
  Extent stroke, velocity;
  for (const RunCurves& run : diagnosis.curves) {
    if (run.velocity.size() != run.stroke.size()) return {};
    stroke.take(run.stroke, shown.factor);
    velocity.take(run.velocity, shown.factor);
  }
  if (!(stroke.low < stroke.high) || !(velocity.low < velocity.high)) return {};
  std::vector<double> sum(kCells * kCells, 0.0), count(kCells * kCells, 0.0);
  for (const RunCurves& run : diagnosis.curves) {
    const auto& force = after ? run.force_after : run.force_before;
    for (std::size_t i = 0; i < force.size() && i < run.stroke.size(); ++i) {
      const std::size_t cell = velocity.cell(run.velocity[i] * shown.factor) * kCells +
                               stroke.cell(run.stroke[i] * shown.factor);
      sum[cell] += force[i];
      count[cell] += 1.0;
    }
  }
  Map map;
  map.title = after ? "Force still missing, over stroke and velocity"
                    : "Missing force over stroke and velocity";
  map.unit = diagnosis.improved.length_unit + "/s²";
  map.x.label = fmt::format("stroke, {}", shown.unit);
  map.y.label = fmt::format("velocity, {}/s", shown.unit);
  map.x_edges = stroke.edges();
  map.y_edges = velocity.edges();
  map.values.resize(sum.size());
  for (std::size_t k = 0; k < sum.size(); ++k)
    map.values[k] = count[k] > 0.0 ? sum[k] / count[k] : std::numeric_limits<double>::quiet_NaN();
  return to_svg(map);
}

std::string remaining_map(const Diagnosis& diagnosis) {
  if (!diagnosis.remaining || diagnosis.remaining->cells.empty()) return {};
  const Shown shown = shown_length(diagnosis.improved.length_unit);
  Extent stroke, velocity;
  for (const auto& cell : diagnosis.remaining->cells) {
    stroke.take({cell.stroke}, shown.factor);
    velocity.take({cell.velocity}, shown.factor);
  }
  if (!(stroke.low < stroke.high) || !(velocity.low < velocity.high)) return {};
  Map map;
  map.title = "What is left as a force of stroke and velocity (dots: within its uncertainty)";
  map.unit = diagnosis.improved.length_unit + "/s²";
  map.x.label = fmt::format("stroke, {}", shown.unit);
  map.y.label = fmt::format("velocity, {}/s", shown.unit);
  map.x_edges = stroke.edges();
  map.y_edges = velocity.edges();
  map.values.assign(kCells * kCells, std::numeric_limits<double>::quiet_NaN());
  map.dotted.assign(kCells * kCells, 0);
  for (const auto& cell : diagnosis.remaining->cells) {
    const std::size_t at = velocity.cell(cell.velocity * shown.factor) * kCells +
                           stroke.cell(cell.stroke * shown.factor);
    map.values[at] = cell.force;
    map.dotted[at] = cell.significant() ? 0 : 1;
  }
  return to_svg(map);
}

std::string harmonics_bars(const Diagnosis& diagnosis) {
  const auto& share = diagnosis.location.share_of_harmonic;
  if (share.empty()) return {};
  Bars bars;
  bars.title = "Share of the gap in each harmonic of the excitation";
  bars.series = {"base model"};
  bars.values.resize(1);
  bars.y = {"share of the gap, %", 0.0, {}, false};
  for (std::size_t k = 0; k < share.size(); ++k) {
    bars.labels.push_back(k == 0 ? "mean" : std::to_string(k));
    bars.values[0].push_back(100.0 * share[k]);
  }
  return to_svg(bars);
}

}  // namespace shaker::report
