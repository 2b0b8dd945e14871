// Ranks the runs that a rig allows by how well they determine the parameters.
#include "estimator/design/plan.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "cli/made_by.hpp"
#include "cli/plan_aim.hpp"
#include "cli/planned_campaign.hpp"
#include "config/model.hpp"
#include "config/rig.hpp"
#include "estimator/model/run_models.hpp"
#include "report/plan_page.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using OrderedJson = nlohmann::ordered_json;
namespace est = shaker::estimator;

constexpr double kDefaultNoise = 2e-5;  // m; of a good stroke transducer
constexpr int kDefaultFrequencies = 12, kDefaultAmplitudes = 6;
constexpr int kRefinements = 2;  // of the default setpoints

std::vector<double> spread_frequencies(const config::Limits& limits) {
  const double low = limits.frequency_min_hz, high = limits.frequency_max_hz;
  std::vector<double> all;
  for (int i = 0; i < kDefaultFrequencies; ++i) {
    const double between = low * std::pow(high / low, i / (kDefaultFrequencies - 1.0));
    all.push_back(std::clamp(est::settable(between), low, high));
  }
  return all;
}

std::vector<double> spread_amplitudes(const config::Limits& limits) {
  const double most = limits.excitation_max_m_s2;
  std::vector<double> all;
  for (int i = 1; i <= kDefaultAmplitudes; ++i)
    all.push_back(std::min(est::settable(most * i / kDefaultAmplitudes), most));
  return all;
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
      "period, {}.\n\n",
      possible, plan.candidates.size(), options.noise, model.length_unit(), options.points,
      options.minutes > 0.0
          ? fmt::format("{:g} minutes of rig time a set, of which each run settles {:g} cycles",
                        options.minutes, options.settle_cycles)
          : fmt::format("{} cycles a run", options.cycles));
  std::vector<std::vector<std::string>> rows = {
      {fmt::format("runs: Hz and {}/s^2", model.length_unit()), "spread", "measuring"}};
  for (const int k : plan.free)
    rows[0].push_back(model.parameters()[static_cast<std::size_t>(k)].name);
  const std::vector<double> theta = model.start();
  const auto add = [&](const est::PlanSet& set, std::string name) {
    rows.push_back(
        {std::move(name), report::percent(100.0 * set.spread), report::duration(set.seconds)});
    for (std::size_t k = 0; k < plan.free.size(); ++k)
      rows.back().push_back(report::percent(
          report::half_interval(set, k, theta[static_cast<std::size_t>(plan.free[k])])));
  };
  for (const est::PlanSet& set : plan.sets)
    add(set, report::names_of(plan, set));
  for (std::size_t k = 0; k < plan.free.size(); ++k)
    add(plan.sharpest[k],
        fmt::format("best for {}: {}",
                    model.parameters()[static_cast<std::size_t>(plan.free[k])].name,
                    report::names_of(plan, plan.sharpest[k])));
  std::vector<bool> right(rows[0].size(), true);
  right[0] = false;
  fmt::print("{}\n", report::text_table(rows, right));
  std::size_t size = 0;
  for (const est::PlanSet& set : plan.sets) {
    if (set.runs.size() == size) continue;  // only the best set of each size
    size = set.runs.size();
    for (const std::string& warning : set.warnings)
      fmt::print("{}: {}\n", report::names_of(plan, set), warning);
  }
}

// `rig_name`: receives the name of the rig, if there is one.
Result<est::PlanOptions> options_of(const PlanCommand& command, std::string& rig_name) {
  est::PlanOptions options;
  options.frequencies_hz = command.frequencies_hz;
  options.amplitudes = command.amplitudes;
  options.points = command.points;
  options.cycles = command.cycles;
  options.most_runs = command.runs;
  options.threads = command.threads;
  options.minutes = command.minutes;
  options.noise = command.noise;
  if (command.rig.empty()) {
    if (options.frequencies_hz.empty() || options.amplitudes.empty())
      return Error{ErrorKind::invalid,
                   "give a rig file with --rig, or --frequencies and --amplitudes"};
  } else {
    const auto rig = config::load_rig(command.rig);
    if (!rig) return rig.error();
    rig_name = rig->name;
    const config::Limits& l = rig->limits;
    options.limits = {l.stroke_min_m,        l.stroke_max_m,     l.stroke_rate_max_m_s,
                      l.excitation_max_m_s2, l.frequency_min_hz, l.frequency_max_hz};
    if (options.frequencies_hz.empty() && command.amplitudes.empty())
      options.refinements = kRefinements;
    if (options.frequencies_hz.empty()) options.frequencies_hz = spread_frequencies(l);
    if (options.amplitudes.empty()) options.amplitudes = spread_amplitudes(l);
    for (const auto& sensor : rig->sensors) {
      if (const auto* simulated = std::get_if<config::SimulatedSensor>(&sensor);
          simulated != nullptr && options.noise == 0.0)
        options.noise = simulated->noise_m;
    }
  }
  if (options.noise == 0.0) options.noise = kDefaultNoise;
  return options;
}

// Sentences on what varies from run to run, and how the plan takes it.
std::vector<std::string> variation_of(config::ModelSpec spec) {
  std::vector<std::string> own;
  for (config::EffectSpec& line : spec.effects) {
    for (auto& [symbol, parameter] : line.parameters) {
      if (parameter.variation.per != "run") continue;
      own.push_back(symbol);
      parameter.variation = {};
    }
  }
  std::vector<std::string> said;
  if (!own.empty())
    said.push_back(fmt::format("each run has its own value of {}: the errors are those of the mean",
                               fmt::join(own, ", ")));
  if (auto why = est::taken_as_one(spec, "a plan"); !why.empty()) said.push_back(std::move(why));
  return said;
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
  std::string rig_name;
  auto options = options_of(command, rig_name);
  if (!options) return fail(common, kBadInput, options.error().what);
  try {
    const est::Model model(*spec);
    const auto aim = aim_of(command, *spec, model);
    if (!aim)
      return fail(common, aim.error().kind == ErrorKind::not_converged ? kNotUsable : kBadInput,
                  aim.error().what);
    const std::string lost = take_aim(*aim, model, *options);
    const auto made = est::make_plan(model, *options);
    if (!made) return fail(common, kBadInput, made.error().what);
    if (!command.draw.empty()) {
      std::ofstream file(command.draw);
      file << report::plan_page(model, *options, *made,
                                {{"rig", rig_name}, {"planned", made_by()}});
      if (!file.flush())
        return fail(common, kBadInput,
                    fmt::format("{} could not be written", command.draw.string()));
    }
    if (common.json) {
      auto json = to_json(model, *options, *made);
      add_aim(*made, *aim, json);
      if (!lost.empty()) json["aim"]["warning"] = lost;
      json["warnings"] = variation_of(*spec);
      fmt::print("{}\n", json.dump());
    } else {
      print(model, *options, *made);
      print_aim(*made, *aim, options->prior.size());
      if (!lost.empty()) fmt::print("{}\n", lost);
      for (const std::string& sentence : variation_of(*spec))
        fmt::print("{}\n", sentence);
    }
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
