// Ranks the runs that a rig allows by how well they determine the parameters.
#include "estimator/plan/plan.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "cli/planned_campaign.hpp"
#include "config/model.hpp"
#include "config/rig.hpp"
#include "report/plot/plot.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using OrderedJson = nlohmann::ordered_json;
namespace est = shaker::estimator;

constexpr double kDefaultNoise = 2e-5;  // m; of a good stroke transducer
constexpr double kQuantile = 1.96;      // normal distribution: the noise is taken as known
constexpr int kDefaultFrequencies = 12, kDefaultAmplitudes = 6;

void spread_setpoints(const config::Limits& limits, est::PlanOptions& options) {
  const double low = limits.frequency_min_hz, high = limits.frequency_max_hz;
  for (int i = 0; options.frequencies_hz.size() < kDefaultFrequencies && i < kDefaultFrequencies;
       ++i)
    options.frequencies_hz.push_back(low * std::pow(high / low, i / (kDefaultFrequencies - 1.0)));
}

std::string name_of(const est::PlanCandidate& c) {
  return fmt::format("{:.3g} Hz {:.3g}", c.frequency_hz, c.amplitude);
}

std::string names_of(const est::Plan& plan, const est::PlanSet& set) {
  std::string text;
  for (const std::size_t r : set.runs)
    text += (text.empty() ? "" : ", ") + name_of(plan.candidates[r]);
  return text;
}

// Half of the 95 % interval, in per cent of the parameter, or of 1 when the parameter is 0.
double half_interval(const est::PlanSet& set, std::size_t k, double theta) {
  return 100.0 * kQuantile * set.error[k] / (theta != 0.0 ? std::fabs(theta) : 1.0);
}

std::string percent(double value) {
  return std::isfinite(value) ? fmt::format("{:.2g} %", value) : "open";
}

OrderedJson to_json(const est::Model& model, const est::Plan& plan, const est::PlanSet& set) {
  OrderedJson runs = OrderedJson::array(), parameters = OrderedJson::array();
  for (const std::size_t r : set.runs)
    runs.push_back({{"frequency_hz", plan.candidates[r].frequency_hz},
                    {"amplitude", plan.candidates[r].amplitude}});
  for (std::size_t k = 0; k < plan.free.size(); ++k) {
    OrderedJson item = {{"name", model.parameters()[static_cast<std::size_t>(plan.free[k])].name},
                        {"determined", std::isfinite(set.error[k])}};
    if (std::isfinite(set.error[k])) item["standard_error"] = set.error[k];
    parameters.push_back(std::move(item));
  }
  return {{"runs", std::move(runs)},
          {"spread", set.spread},
          {"determined", set.determined},
          {"measuring_s", set.seconds},
          {"parameters", std::move(parameters)},
          {"warnings", set.warnings}};
}

OrderedJson to_json(const est::Model& model, const est::PlanOptions& options,
                    const est::Plan& plan) {
  OrderedJson sets = OrderedJson::array(), sharpest = OrderedJson::object(),
              candidates = OrderedJson::array();
  for (const est::PlanSet& set : plan.sets)
    sets.push_back(to_json(model, plan, set));
  for (std::size_t k = 0; k < plan.free.size(); ++k)
    sharpest[model.parameters()[static_cast<std::size_t>(plan.free[k])].name] =
        to_json(model, plan, plan.sharpest[k]);
  for (const est::PlanCandidate& c : plan.candidates) {
    OrderedJson item = {{"frequency_hz", c.frequency_hz},
                        {"amplitude", c.amplitude},
                        {"possible", c.refused.empty()}};
    if (c.refused.empty()) {
      item["stroke_min"] = c.stroke_low;
      item["stroke_max"] = c.stroke_high;
      item["stroke_rate_max"] = c.rate;
    } else {
      item["why"] = c.refused;
    }
    candidates.push_back(std::move(item));
  }
  return {{"model", model.name()},
          {"noise", options.noise},
          {"points", options.points},
          {"cycles", options.cycles},
          {"sets", std::move(sets)},
          {"sharpest", std::move(sharpest)},
          {"candidates", std::move(candidates)}};
}

void print(const est::Model& model, const est::PlanOptions& options, const est::Plan& plan) {
  std::size_t possible = 0;
  for (const est::PlanCandidate& c : plan.candidates)
    possible += c.refused.empty();
  fmt::print(
      "{} of {} runs are possible. Intervals: half of 95 %, with noise of {:g} {}, {} points a "
      "period, {} cycles a run.\n\n",
      possible, plan.candidates.size(), options.noise, model.length_unit(), options.points,
      options.cycles);
  std::vector<std::vector<std::string>> rows = {{"runs", "spread", "measuring"}};
  for (const int k : plan.free)
    rows[0].push_back(model.parameters()[static_cast<std::size_t>(k)].name);
  const std::vector<double> theta = model.start();
  const auto add = [&](const est::PlanSet& set, std::string name) {
    rows.push_back({std::move(name), percent(100.0 * set.spread), report::duration(set.seconds)});
    for (std::size_t k = 0; k < plan.free.size(); ++k)
      rows.back().push_back(
          percent(half_interval(set, k, theta[static_cast<std::size_t>(plan.free[k])])));
  };
  for (const est::PlanSet& set : plan.sets)
    add(set, names_of(plan, set));
  for (std::size_t k = 0; k < plan.free.size(); ++k)
    add(plan.sharpest[k],
        fmt::format("best for {}: {}",
                    model.parameters()[static_cast<std::size_t>(plan.free[k])].name,
                    names_of(plan, plan.sharpest[k])));
  std::vector<bool> right(rows[0].size(), true);
  right[0] = false;
  fmt::print("{}\n", report::text_table(rows, right));
  std::size_t size = 0;
  for (const est::PlanSet& set : plan.sets) {
    if (set.runs.size() == size) continue;  // only the best set of each size
    size = set.runs.size();
    for (const std::string& warning : set.warnings)
      fmt::print("{}: {}\n", names_of(plan, set), warning);
  }
}

// The edges of cells around the values.
std::vector<double> edges_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  std::vector<double> edges;
  if (values.size() == 1) return {0.9 * values[0], 1.1 * values[0]};
  edges.push_back(values[0] - 0.5 * (values[1] - values[0]));
  for (std::size_t i = 1; i < values.size(); ++i)
    edges.push_back(0.5 * (values[i - 1] + values[i]));
  edges.push_back(values.back() + 0.5 * (values.back() - values[values.size() - 2]));
  return edges;
}

std::string single_runs_map(const est::Model& model, const est::PlanOptions& options,
                            const est::Plan& plan) {
  report::Map map;
  map.title = "What a single run tells (log10 of the spread; the smaller, the better)";
  map.unit = "log10 spread";
  map.x.label = "frequency, Hz";
  map.y.label = "amplitude";
  std::vector<double> f = options.frequencies_hz, a = options.amplitudes;
  std::sort(f.begin(), f.end());
  std::sort(a.begin(), a.end());
  map.x_edges = edges_of(f);
  map.y_edges = edges_of(a);
  map.values.assign(f.size() * a.size(), std::nan(""));
  for (std::size_t i = 0; i < plan.candidates.size(); ++i) {
    const est::PlanCandidate& c = plan.candidates[i];
    if (!c.refused.empty()) continue;
    const auto x = std::lower_bound(f.begin(), f.end(), c.frequency_hz) - f.begin();
    const auto y = std::lower_bound(a.begin(), a.end(), c.amplitude) - a.begin();
    map.values[static_cast<std::size_t>(y) * f.size() + static_cast<std::size_t>(x)] =
        std::log10(est::judge(model, options, plan, {i}).spread);
  }
  return report::to_svg(map);
}

std::string intervals_bars(const est::Model& model, const est::Plan& plan) {
  report::Bars bars;
  bars.title = "Half of the 95 % intervals from the best set of each size";
  bars.y.label = "per cent of the parameter";
  bars.y.logarithmic = true;
  const std::vector<double> theta = model.start();
  for (const int k : plan.free)
    bars.labels.push_back(model.parameters()[static_cast<std::size_t>(k)].name);
  std::size_t size = 0;
  for (const est::PlanSet& set : plan.sets) {
    if (set.runs.size() == size || bars.series.size() == 4) continue;
    size = set.runs.size();
    bars.series.push_back(fmt::format("{} run{}", size, size == 1 ? "" : "s"));
    bars.values.emplace_back();
    for (std::size_t k = 0; k < plan.free.size(); ++k)
      bars.values.back().push_back(
          half_interval(set, k, theta[static_cast<std::size_t>(plan.free[k])]));
  }
  return report::to_svg(bars);
}

std::string page(const est::Model& model, const est::PlanOptions& options, const est::Plan& plan) {
  std::string rows;
  const std::vector<double> theta = model.start();
  for (const est::PlanSet& set : plan.sets) {
    rows += fmt::format("<tr><td>{}</td><td>{}</td>", report::escaped(names_of(plan, set)),
                        percent(100.0 * set.spread));
    for (std::size_t k = 0; k < plan.free.size(); ++k)
      rows += fmt::format(
          "<td>{}</td>",
          percent(half_interval(set, k, theta[static_cast<std::size_t>(plan.free[k])])));
    std::string notes;
    for (const std::string& warning : set.warnings)
      notes += report::escaped(warning) + " ";
    rows += fmt::format("<td>{}</td></tr>\n", notes);
  }
  std::string head = "<th>runs</th><th>spread</th>";
  for (const int k : plan.free)
    head += fmt::format("<th>{}</th>",
                        report::escaped(model.parameters()[static_cast<std::size_t>(k)].name));
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Plan for {0}</title>"
      "<style>{1} body{{font-family:sans-serif;margin:2em}} td,th{{padding:.2em .8em;"
      "text-align:left;vertical-align:top}}</style></head>\n<body><h1>Plan for {0}</h1>\n{2}\n{3}\n"
      "<table><tr>{4}<th>open</th></tr>\n{5}</table></body></html>\n",
      report::escaped(model.name()), report::plot_style(), single_runs_map(model, options, plan),
      intervals_bars(model, plan), head, rows);
}

Result<est::PlanOptions> options_of(const PlanCommand& command) {
  est::PlanOptions options;
  options.frequencies_hz = command.frequencies_hz;
  options.amplitudes = command.amplitudes;
  options.points = command.points;
  options.cycles = command.cycles;
  options.most_runs = command.runs;
  options.threads = command.threads;
  options.noise = command.noise;
  if (command.rig.empty()) {
    if (options.frequencies_hz.empty() || options.amplitudes.empty())
      return Error{ErrorKind::invalid,
                   "give a rig file with --rig, or --frequencies and --amplitudes"};
  } else {
    const auto rig = config::load_rig(command.rig);
    if (!rig) return rig.error();
    const config::Limits& l = rig->limits;
    options.limits = {l.stroke_min_m,        l.stroke_max_m,     l.stroke_rate_max_m_s,
                      l.excitation_max_m_s2, l.frequency_min_hz, l.frequency_max_hz};
    if (options.frequencies_hz.empty()) spread_setpoints(l, options);
    for (int i = 1; command.amplitudes.empty() && i <= kDefaultAmplitudes; ++i)
      options.amplitudes.push_back(l.excitation_max_m_s2 * i / kDefaultAmplitudes);
    for (const auto& sensor : rig->sensors) {
      if (const auto* simulated = std::get_if<config::SimulatedSensor>(&sensor);
          simulated != nullptr && options.noise == 0.0)
        options.noise = simulated->noise_m;
    }
  }
  if (options.noise == 0.0) options.noise = kDefaultNoise;
  return options;
}

}  // namespace

int plan(const Common& common, const PlanCommand& command) {
  const auto spec = config::load_model(command.model);
  if (!spec) return fail(common, kBadInput, spec.error().what);
  if (!command.rig.empty() && spec->length_unit != "m") {
    return fail(common, kBadInput,
                fmt::format("{} counts in {}, the rig's limits are in m; give a model in m",
                            command.model.string(), spec->length_unit));
  }
  const auto options = options_of(command);
  if (!options) return fail(common, kBadInput, options.error().what);
  try {
    const est::Model model(*spec);
    const auto made = est::make_plan(model, *options);
    if (!made) return fail(common, kBadInput, made.error().what);
    if (!command.draw.empty()) {
      std::ofstream file(command.draw);
      file << page(model, *options, *made);
      if (!file.flush())
        return fail(common, kBadInput,
                    fmt::format("{} could not be written", command.draw.string()));
    }
    if (common.json)
      fmt::print("{}\n", to_json(model, *options, *made).dump());
    else
      print(model, *options, *made);
    if (!command.write.empty()) {
      const auto written = write_planned_campaign(command.write, *spec, *made, *options);
      if (!written) return fail(common, kBadInput, written.error().what);
      if (!common.json) fmt::print("{}\n", command.write.string());
    }
    const bool some = std::any_of(made->sets.begin(), made->sets.end(),
                                  [](const est::PlanSet& set) { return set.determined; });
    return some ? kOk : kNegative;
  } catch (const std::invalid_argument& error) {
    return fail(common, kBadInput, error.what());
  }
}

}  // namespace shaker::cli
