#include "cli/drop_picture.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include <fmt/format.h>

#include "estimator/drop/unnamed_force.hpp"
#include "report/plot/plot.hpp"

namespace shaker::cli {
namespace {

constexpr double kSettledShare = 0.05;  // of the largest load
constexpr double kMargin = 2.0;         // of the time in which something happens

// `values` per mass times `mass`, up to `count`.
std::vector<double> scaled(const std::vector<double>& values, double mass, std::size_t count) {
  std::vector<double> out(
      values.begin(), values.begin() + static_cast<std::ptrdiff_t>(std::min(count, values.size())));
  for (double& value : out)
    value *= mass;
  return out;
}

std::size_t count_until(const std::vector<double>& t, double end) {
  return static_cast<std::size_t>(std::upper_bound(t.begin(), t.end(), end) - t.begin());
}

}  // namespace

double eventful_time(const estimator::DropHistory& history) {
  if (history.t.empty()) return 0.0;
  double largest = 0.0;
  for (const double load : history.load)
    largest = std::max(largest, std::fabs(load));
  std::size_t i = history.t.size();
  while (i > 0 && std::fabs(history.load[i - 1] - history.load.back()) <= kSettledShare * largest)
    --i;
  return std::min(history.t.back(), kMargin * (i > 0 ? history.t[i - 1] : history.t.back()));
}

estimator::HistoryBand linear_band(const estimator::DropHistory& h) {
  constexpr double kQuantile = 1.96;
  estimator::HistoryBand band;
  if (h.load_error.empty()) return band;
  band.t = h.t;
  for (std::size_t i = 0; i < h.t.size(); ++i) {
    band.stroke_lower.push_back(h.stroke[i] - kQuantile * h.stroke_error[i]);
    band.stroke_upper.push_back(h.stroke[i] + kQuantile * h.stroke_error[i]);
    band.load_lower.push_back(h.load[i] - kQuantile * h.load_error[i]);
    band.load_upper.push_back(h.load[i] + kQuantile * h.load_error[i]);
  }
  return band;
}

namespace {

std::string load_label(const DropPictureOptions& options) {
  return options.mass ? "load, N" : fmt::format("load per mass, {}/s^2", options.length_unit);
}

// Until when a picture over time goes.
double drawn_time(const estimator::DropRun& run) {
  const double peak = std::isfinite(run.figures[1]) ? kMargin * run.figures[1] : 0.0;
  return std::max(eventful_time(run.history), peak);
}

// The bands of a curve over time, up to `end`.
void add_bands(const DropPictureOptions& options, double end,
               std::vector<double> estimator::HistoryBand::*lower,
               std::vector<double> estimator::HistoryBand::*upper, double factor,
               report::Plot& plot) {
  const auto add = [&](const estimator::HistoryBand* band, const char* name, report::Ink ink) {
    if (band == nullptr || band->t.empty()) return;
    const std::size_t size = count_until(band->t, end);
    plot.bands.push_back({name, scaled(band->t, 1.0, size), scaled(band->*lower, factor, size),
                          scaled(band->*upper, factor, size), ink});
  };
  add(options.band, "95 %", report::Ink::first);
  add(options.joined, "95 % with the measured drop", report::Ink::second);
}

report::Plot load_over_time(const estimator::DropRun& run, const estimator::DropHistory* truth,
                            const DropPictureOptions& options) {
  const auto& h = run.history;
  const double mass = options.mass.value_or(1.0);
  const double end = std::max(drawn_time(run), truth != nullptr ? eventful_time(*truth) : 0.0);
  const std::size_t count = count_until(h.t, end);
  report::Plot plot;
  plot.title = fmt::format("Predicted drop at {:g} {}/s: load over time", options.sink_speed,
                           options.length_unit);
  plot.x.label = "time, s";
  plot.y.label = load_label(options);
  const std::vector<double> t = scaled(h.t, 1.0, count);
  add_bands(options, end, &estimator::HistoryBand::load_lower, &estimator::HistoryBand::load_upper,
            mass, plot);
  plot.curves.push_back(
      {"predicted", t, scaled(h.load, mass, count), report::Ink::first, report::Stroke::line});
  if (truth != nullptr) {
    const std::size_t size = count_until(truth->t, end);
    plot.curves.push_back({"truth", scaled(truth->t, 1.0, size), scaled(truth->load, mass, size),
                           report::Ink::second, report::Stroke::dashed});
  }
  if (options.measured != nullptr && !options.measured->load.empty()) {
    const std::size_t size = count_until(options.measured->t, end);
    plot.curves.push_back({"measured", scaled(options.measured->t, 1.0, size),
                           scaled(options.measured->load, mass, size), report::Ink::third,
                           report::Stroke::points});
  }
  plot.marks.push_back({"peak stroke", run.figures[1], true});
  return plot;
}

// Linear between the times.
double read_at(const std::vector<double>& t, const std::vector<double>& values, double at) {
  const auto above = std::upper_bound(t.begin(), t.end(), at);
  const auto i = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(above - t.begin(), 1, static_cast<std::ptrdiff_t>(t.size()) - 1));
  const double share = (at - t[i - 1]) / (t[i] - t[i - 1]);
  return values[i - 1] + share * (values[i] - values[i - 1]);
}

report::Plot stroke_over_time(const DropScene& scene) {
  const auto& h = scene.run->history;
  const auto& options = scene.options;
  const double end = drawn_time(*scene.run);
  const std::size_t count = count_until(h.t, end);
  report::Plot plot;
  plot.title = "Stroke over time";
  plot.x.label = "time, s";
  plot.y.label = "stroke, " + options.length_unit;
  const std::vector<double> t = scaled(h.t, 1.0, count);
  add_bands(options, end, &estimator::HistoryBand::stroke_lower,
            &estimator::HistoryBand::stroke_upper, 1.0, plot);
  plot.curves.push_back(
      {"predicted", t, scaled(h.stroke, 1.0, count), report::Ink::first, report::Stroke::line});
  if (!h.travel.empty())
    plot.curves.push_back({"descent of the mass", t, scaled(h.travel, 1.0, count),
                           report::Ink::second, report::Stroke::dashed});
  if (options.measured != nullptr && !options.measured->stroke.empty()) {
    const auto& m = *options.measured;
    const std::size_t size = count_until(m.t, end);
    plot.curves.push_back({"measured", scaled(m.t, 1.0, size), scaled(m.stroke, 1.0, size),
                           report::Ink::third, report::Stroke::points});
  }
  return plot;
}

// The band at the time of a stroke, as long as the stroke grows.
report::Band band_over_stroke(const estimator::DropRun& run, const std::vector<double>& t,
                              const std::vector<double>& lower, const std::vector<double>& upper,
                              double factor) {
  report::Band band{"95 %, until the stroke turns", {}, {}, {}, report::Ink::first};
  const auto& h = run.history;
  for (std::size_t i = 0; i < t.size() && t[i] <= run.figures[1]; ++i) {
    const double stroke = read_at(h.t, h.stroke, t[i]);
    if (!band.x.empty() && stroke <= band.x.back()) continue;
    band.x.push_back(stroke);
    band.lower.push_back(factor * lower[i]);
    band.upper.push_back(factor * upper[i]);
  }
  return band;
}

report::Plot load_over_stroke(const DropScene& scene) {
  const auto& h = scene.run->history;
  const auto& options = scene.options;
  const double mass = options.mass.value_or(1.0);
  const std::size_t count = count_until(h.t, drawn_time(*scene.run));
  report::Plot plot;
  plot.title = "Load over stroke";
  plot.x.label = "stroke, " + options.length_unit;
  plot.y.label = load_label(options);
  if (options.band != nullptr && !options.band->load_lower.empty())
    plot.bands.push_back(band_over_stroke(*scene.run, options.band->t, options.band->load_lower,
                                          options.band->load_upper, mass));
  plot.curves.push_back({"predicted", scaled(h.stroke, 1.0, count), scaled(h.load, mass, count),
                         report::Ink::first, report::Stroke::line});
  if (options.measured != nullptr && !options.measured->stroke.empty() &&
      !options.measured->load.empty())
    plot.curves.push_back({"measured", options.measured->stroke,
                           scaled(options.measured->load, mass, options.measured->load.size()),
                           report::Ink::third, report::Stroke::points});
  return plot;
}

// The drop inside and outside of what was visited.
report::Plot velocity_over_stroke(const DropScene& scene) {
  const auto& h = scene.run->history;
  const estimator::VisitedRegion region(*scene.visited);
  const std::size_t count = count_until(h.t, drawn_time(*scene.run));
  report::Plot plot;
  plot.title = "Velocity over stroke: what the campaign visited, and the drop";
  plot.x.label = "stroke, " + scene.options.length_unit;
  plot.y.label = "velocity, " + scene.options.length_unit + "/s";
  const auto* own = scene.options.band;
  if (own != nullptr && !own->speed_lower.empty())
    plot.bands.push_back(
        band_over_stroke(*scene.run, own->t, own->speed_lower, own->speed_upper, 1.0));
  report::Curve cells{"visited", {}, {}, report::Ink::quiet, report::Stroke::points};
  for (const estimator::VisitedCell& cell : *scene.visited) {
    cells.x.push_back(cell.stroke);
    cells.y.push_back(cell.velocity);
  }
  report::Curve out{"drop, not visited", {}, {}, report::Ink::second, report::Stroke::line};
  report::Curve in{"drop, visited", {}, {}, report::Ink::first, report::Stroke::line};
  constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t i = 0; i < count; ++i) {
    const bool inside = !region.empty() && region.holds(h.stroke[i], h.speed[i]);
    for (auto* curve : {&out, &in}) {
      curve->x.push_back(h.stroke[i]);
      curve->y.push_back(inside == (curve == &in) ? h.speed[i] : kGap);
    }
  }
  plot.curves = {std::move(cells), std::move(out)};
  if (std::any_of(in.y.begin(), in.y.end(), [](double y) { return std::isfinite(y); }))
    plot.curves.push_back(std::move(in));
  return plot;
}

// The effects with the largest shares of the peak load or the energy; the others are too small.
report::Plot shares_over_time(const DropScene& scene) {
  constexpr double kLeastShare = 0.002;
  const auto& h = scene.run->history;
  const double mass = scene.options.mass.value_or(1.0);
  const std::size_t count = count_until(h.t, drawn_time(*scene.run));
  report::Plot plot;
  plot.title = "What carries the load";
  plot.x.label = "time, s";
  plot.y.label = load_label(scene.options);
  const report::Ink inks[] = {report::Ink::first, report::Ink::second, report::Ink::third,
                              report::Ink::fourth};
  std::size_t drawn = 0;
  for (const estimator::EffectShare& share : scene.shares->effects) {
    if (drawn == std::size(inks) ||
        std::max(std::fabs(share.of_peak_load), std::fabs(share.of_energy)) < kLeastShare)
      continue;
    plot.curves.push_back({share.effect, scaled(h.t, 1.0, count), scaled(share.load, mass, count),
                           inks[drawn],
                           drawn % 2 == 0 ? report::Stroke::line : report::Stroke::dashed});
    ++drawn;
  }
  return plot;
}

}  // namespace

std::string drop_picture(const estimator::DropRun& run, const estimator::DropHistory* truth,
                         const DropPictureOptions& options) {
  return report::svg_file(report::to_svg(load_over_time(run, truth, options)));
}

std::string drop_pictures(const DropScene& scene) {
  std::string pictures = report::to_svg(load_over_time(*scene.run, nullptr, scene.options)) +
                         report::to_svg(load_over_stroke(scene)) +
                         report::to_svg(stroke_over_time(scene)) +
                         report::to_svg(velocity_over_stroke(scene));
  if (!scene.shares->effects.empty()) pictures += report::to_svg(shares_over_time(scene));
  return pictures;
}

}  // namespace shaker::cli
