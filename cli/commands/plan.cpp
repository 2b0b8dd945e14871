// Ranks the runs that a rig allows by how well they determine the parameters.
#include "estimator/design/plan.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "cli/made_by.hpp"
#include "cli/planned_campaign.hpp"
#include "config/model.hpp"
#include "config/rig.hpp"
#include "estimator/time/drop.hpp"
#include "report/plan_page.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using OrderedJson = nlohmann::ordered_json;
namespace est = shaker::estimator;

constexpr double kDefaultNoise = 2e-5;  // m; of a good stroke transducer
constexpr double kHalfOf95 = 1.96;
constexpr int kDefaultFrequencies = 12, kDefaultAmplitudes = 6;

void spread_setpoints(const config::Limits& limits, est::PlanOptions& options) {
  const double low = limits.frequency_min_hz, high = limits.frequency_max_hz;
  for (int i = 0; options.frequencies_hz.size() < kDefaultFrequencies && i < kDefaultFrequencies;
       ++i)
    options.frequencies_hz.push_back(low * std::pow(high / low, i / (kDefaultFrequencies - 1.0)));
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
  std::vector<std::vector<std::string>> rows = {{"runs", "spread", "measuring"}};
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

// What a plan aims at: its name, its value at the starts, and its derivatives; no derivatives: the
// volume of all parameters.
struct PlanAim {
  std::string label, unit;
  double value = 0.0;
  std::vector<double> derivatives;
};

// The peak load's derivatives are those of the load at its time, since it is largest there.
Result<PlanAim> aim_at_drop(const PlanCommand& command, const config::ModelSpec& spec) {
  if (!command.sink_speed)
    return Error{ErrorKind::invalid, "--for drop needs --sink-speed, in m/s"};
  estimator::DropConditions conditions;
  conditions.sink_speed = *command.sink_speed;
  conditions.lift = command.lift;
  const est::DropTest test(spec, conditions);
  const auto run = test.run(test.model().start(), true);
  if (!run) return run.error();
  const auto& load = run->history.load;
  const auto peak =
      static_cast<std::size_t>(std::max_element(load.begin(), load.end()) - load.begin());
  const auto p = static_cast<std::size_t>(test.model().parameter_count());
  PlanAim aim = {fmt::format("peak load at {:g} {}/s", *command.sink_speed, spec.length_unit),
                 spec.length_unit + "/s^2",
                 load[peak],
                 {}};
  for (std::size_t k = 0; k < p; ++k)
    aim.derivatives.push_back(run->load_derivatives[peak * p + k]);
  return aim;
}

Result<PlanAim> aim_of(const PlanCommand& command, const config::ModelSpec& spec,
                       const est::Model& model) {
  if (command.aim == "drop") return aim_at_drop(command, spec);
  if (command.sink_speed) return Error{ErrorKind::invalid, "--sink-speed belongs to --for drop"};
  PlanAim aim;
  if (command.aim == "all") return aim;
  std::string names;
  for (const auto& p : model.parameters()) {
    aim.derivatives.push_back(p.name == command.aim ? 1.0 : 0.0);
    if (p.fixed) continue;
    if (p.name == command.aim) {
      aim.label = p.name;
      aim.unit = p.unit;
      aim.value = p.start;
    }
    names += (names.empty() ? "" : ", ") + p.name;
  }
  if (!aim.label.empty()) return aim;
  return Error{ErrorKind::invalid, fmt::format("--for {}: there is no such free parameter; say "
                                               "all, drop, or one of {}",
                                               command.aim, names)};
}

// Half of the 95 % interval in per cent.
std::string aim_percent(const PlanAim& aim, const est::PlanSet& set) {
  return report::percent(100.0 * kHalfOf95 * set.aim_error /
                         (aim.value != 0.0 ? std::fabs(aim.value) : 1.0));
}

void print_aim(const est::Plan& plan, const PlanAim& aim) {
  if (aim.derivatives.empty()) return;
  std::vector<std::vector<std::string>> rows = {{"runs", "half of 95 % of " + aim.label}};
  for (const est::PlanSet& set : plan.sets)
    rows.push_back({report::names_of(plan, set), aim_percent(aim, set)});
  for (const est::PlanSet& set : plan.by_volume)
    rows.push_back({"best for the volume: " + report::names_of(plan, set), aim_percent(aim, set)});
  fmt::print("{}\n", report::text_table(rows, {false, true}));
}

void add_aim(const est::Plan& plan, const PlanAim& aim, OrderedJson& json) {
  if (aim.derivatives.empty()) return;
  const auto entries = [&](const std::vector<est::PlanSet>& sets) {
    OrderedJson out = OrderedJson::array();
    for (const est::PlanSet& set : sets)
      out.push_back({{"runs", report::names_of(plan, set)},
                     {"cycles", set.cycles},
                     {"determined", set.determined},
                     {"standard_error", set.aim_error}});
    return out;
  };
  json["aim"] = {{"label", aim.label},
                 {"unit", aim.unit},
                 {"value", aim.value},
                 {"sets", entries(plan.sets)},
                 {"by_volume", entries(plan.by_volume)}};
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
  std::string rig_name;
  auto options = options_of(command, rig_name);
  if (!options) return fail(common, kBadInput, options.error().what);
  try {
    const est::Model model(*spec);
    const auto aim = aim_of(command, *spec, model);
    if (!aim)
      return fail(common, aim.error().kind == ErrorKind::not_converged ? kNotUsable : kBadInput,
                  aim.error().what);
    options->aim = aim->derivatives;
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
      fmt::print("{}\n", json.dump());
    } else {
      print(model, *options, *made);
      print_aim(*made, *aim);
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
