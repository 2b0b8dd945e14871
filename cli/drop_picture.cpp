#include "cli/drop_picture.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

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

std::string drop_picture(const estimator::DropRun& run, const estimator::DropHistory* truth,
                         const DropPictureOptions& options) {
  const auto& h = run.history;
  const double mass = options.mass.value_or(1.0);
  const double peak = std::isfinite(run.figures[1]) ? kMargin * run.figures[1] : 0.0;
  const double end =
      std::max({eventful_time(h), truth != nullptr ? eventful_time(*truth) : 0.0, peak});
  const std::size_t count = count_until(h.t, end);
  report::Plot plot;
  plot.title = fmt::format("Predicted drop at {:g} {}/s: load over time", options.sink_speed,
                           options.length_unit);
  plot.x.label = "time, s";
  plot.y.label =
      options.mass ? "load, N" : fmt::format("load per mass, {}/s^2", options.length_unit);
  const std::vector<double> t = scaled(h.t, 1.0, count);
  if (options.band != nullptr && !options.band->t.empty()) {
    const auto& own = *options.band;
    const std::size_t size = count_until(own.t, end);
    plot.bands.push_back({"95 %", scaled(own.t, 1.0, size), scaled(own.load_lower, mass, size),
                          scaled(own.load_upper, mass, size), report::Ink::first});
  }
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
  return report::svg_file(report::to_svg(plot));
}

}  // namespace shaker::cli
