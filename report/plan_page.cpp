#include "report/plan_page.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "report/plot/plot.hpp"

namespace shaker::report {
namespace {

using estimator::Model;
using estimator::Plan;
using estimator::PlanCandidate;
using estimator::PlanOptions;
using estimator::PlanSet;

constexpr double kQuantile = 1.96;  // normal distribution: the noise is taken as known
constexpr std::size_t kSeriesMax = 4;

// The edges of cells around ascending values: half way between neighbours, by their ratio where
// the axis is logarithmic.
std::vector<double> edges_of(std::vector<double> values, bool logarithmic) {
  for (double& value : values)
    value = logarithmic ? std::log(value) : value;
  std::vector<double> edges;
  if (values.size() == 1) {
    const double margin = logarithmic ? 0.1 : 0.1 * values[0];
    edges = {values[0] - margin, values[0] + margin};
  } else {
    edges.push_back(values[0] - 0.5 * (values[1] - values[0]));
    for (std::size_t i = 1; i < values.size(); ++i)
      edges.push_back(0.5 * (values[i - 1] + values[i]));
    edges.push_back(values.back() + 0.5 * (values.back() - values[values.size() - 2]));
  }
  for (double& edge : edges)
    edge = logarithmic ? std::exp(edge) : edge;
  return edges;
}

std::vector<double> ascending(std::vector<double> values) {
  std::ranges::sort(values);
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

std::string amplitude_unit(const Model& model) {
  return model.length_unit() + "/s²";
}

std::string single_runs_map(const Model& model, const PlanOptions& options, const Plan& plan) {
  Map map;
  map.title = "Spread of a single run, log10: the smaller, the better";
  map.unit = "log10";
  map.x.label = "frequency, Hz";
  map.x.logarithmic = true;
  map.y.label = "amplitude, " + amplitude_unit(model);
  const auto f = ascending(options.frequencies_hz), a = ascending(options.amplitudes);
  map.x_edges = edges_of(f, true);
  map.y_edges = edges_of(a, false);
  map.values.assign(f.size() * a.size(), std::nan(""));
  for (std::size_t i = 0; i < plan.candidates.size(); ++i) {
    const PlanCandidate& c = plan.candidates[i];
    if (!c.refused.empty()) continue;
    const auto x = std::ranges::lower_bound(f, c.frequency_hz) - f.begin();
    const auto y = std::ranges::lower_bound(a, c.amplitude) - a.begin();
    map.values[static_cast<std::size_t>(y) * f.size() + static_cast<std::size_t>(x)] =
        std::log10(estimator::judge(model, options, plan, {i}).spread);
  }
  return to_svg(map);
}

std::string free_name(const Model& model, const Plan& plan, std::size_t k) {
  return model.parameters()[static_cast<std::size_t>(plan.free[k])].name;
}

double value_of(const Model& model, const Plan& plan, std::size_t k) {
  return model.start()[static_cast<std::size_t>(plan.free[k])];
}

std::string intervals_bars(const Model& model, const Plan& plan) {
  Bars bars;
  bars.title = "Half of the 95 % intervals, best set of each size";
  bars.y.label = "per cent of the parameter";
  bars.y.logarithmic = true;
  for (std::size_t k = 0; k < plan.free.size(); ++k)
    bars.labels.push_back(free_name(model, plan, k));
  std::size_t size = 0;
  for (const PlanSet& set : plan.sets) {
    if (set.runs.size() == size || bars.series.size() == kSeriesMax) continue;
    size = set.runs.size();
    bars.series.push_back(fmt::format("{} run{}", size, size == 1 ? "" : "s"));
    bars.values.emplace_back();
    for (std::size_t k = 0; k < plan.free.size(); ++k)
      bars.values.back().push_back(half_interval(set, k, value_of(model, plan, k)));
  }
  return to_svg(bars);
}

PageValues sets_table(const Model& model, const Plan& plan) {
  PageValues head = {page_cell("runs: Hz and " + amplitude_unit(model)), page_cell("spread", true)};
  for (std::size_t k = 0; k < plan.free.size(); ++k)
    head.push_back(page_cell(free_name(model, plan, k), true));
  PageValues rows = PageValues::array();
  for (const PlanSet& set : plan.sets) {
    PageValues row = {page_cell(names_of(plan, set)), page_cell(percent(100.0 * set.spread), true)};
    for (std::size_t k = 0; k < plan.free.size(); ++k)
      row.push_back(page_cell(percent(half_interval(set, k, value_of(model, plan, k))), true));
    rows.push_back(std::move(row));
  }
  return page_table(std::move(head), std::move(rows));
}

std::string name_of(const PlanCandidate& c) {
  return fmt::format("{:.3g} Hz {:.3g}", c.frequency_hz, c.amplitude);
}

PageValues refused_table(const Model& model, const Plan& plan) {
  PageValues rows = PageValues::array();
  for (const PlanCandidate& c : plan.candidates)
    if (!c.refused.empty()) rows.push_back({page_cell(name_of(c)), page_cell(c.refused)});
  return page_table({page_cell("run: Hz and " + amplitude_unit(model)), page_cell("reason")},
                    std::move(rows));
}

PageValues remarks_of(const Plan& plan) {
  PageValues remarks = PageValues::array();
  for (const PlanSet& set : plan.sets)
    for (const std::string& warning : set.warnings)
      remarks.push_back(fmt::format("{}: {}", names_of(plan, set), warning));
  return remarks;
}

}  // namespace

std::string names_of(const Plan& plan, const PlanSet& set) {
  std::string text;
  for (const std::size_t r : set.runs)
    text += (text.empty() ? "" : ", ") + name_of(plan.candidates[r]);
  return text;
}

double half_interval(const PlanSet& set, std::size_t k, double theta) {
  return 100.0 * kQuantile * set.error[k] / (theta != 0.0 ? std::fabs(theta) : 1.0);
}

std::string percent(double value) {
  return std::isfinite(value) ? fmt::format("{:.2g} %", value) : "open";
}

std::string plan_page(const Model& model, const PlanOptions& options, const Plan& plan,
                      const TitleBlock& title) {
  const auto possible = std::ranges::count_if(
      plan.candidates, [](const PlanCandidate& c) { return c.refused.empty(); });
  PageValues remarks = remarks_of(plan);
  const bool has_remarks = !remarks.empty();
  const PageValues values = {
      {"sentence", fmt::format("{} of {} runs are possible. Each is measured over {} periods of {} "
                               "samples, with a noise of {:g} {}.",
                               possible, plan.candidates.size(), options.cycles, options.points,
                               options.noise, model.length_unit())},
      {"map", single_runs_map(model, options, plan)},
      {"intervals", intervals_bars(model, plan)},
      {"sets", sets_table(model, plan)},
      {"has_remarks", has_remarks},
      {"remarks", std::move(remarks)},
      {"has_refused", static_cast<std::size_t>(possible) < plan.candidates.size()},
      {"refused", refused_table(model, plan)}};
  TitleBlock block = {{"model", model.name()}};
  block.insert(block.end(), title.begin(), title.end());
  const std::string heading = "Plan for " + model.name();
  return render_page(heading, heading, block, "plan", values);
}

}  // namespace shaker::report
