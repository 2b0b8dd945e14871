#include "cli/plan_aim.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "estimator/design/prior_points.hpp"
#include "estimator/drop/drop.hpp"
#include "report/plan_page.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

using OrderedJson = nlohmann::ordered_json;
namespace est = shaker::estimator;

constexpr double kHalfOf95 = 1.96;

Result<PlanAim> aim_at_drop(const PlanCommand& command, const config::ModelSpec& spec) {
  if (!command.sink_speed)
    return Error{ErrorKind::invalid, "--for drop needs --sink-speed, in m/s"};
  est::DropConditions conditions;
  conditions.sink_speed = *command.sink_speed;
  conditions.lift = command.lift;
  const est::DropTest test(spec, conditions);
  PlanAim aim = {fmt::format("peak load at {:g} {}/s", *command.sink_speed, spec.length_unit),
                 spec.length_unit + "/s^2",
                 0.0,
                 {},
                 {},
                 0};
  auto peak = test.peak_load(test.model().start());
  if (!peak) return peak.error();
  aim.value = peak->value;
  aim.derivatives = std::move(peak->derivatives);
  for (std::vector<double>& theta : est::prior_points(test.model(), command.prior_spread)) {
    auto there = test.peak_load(theta);
    if (there)
      aim.prior.push_back({std::move(theta), std::move(there->derivatives)});
    else
      ++aim.without_drop;
  }
  return aim;
}

// Half of the 95 % interval in per cent.
std::string aim_percent(const PlanAim& aim, const est::PlanSet& set) {
  return report::percent(100.0 * kHalfOf95 * set.aim_over_prior /
                         (aim.value != 0.0 ? std::fabs(aim.value) : 1.0));
}

}  // namespace

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
  if (!aim.label.empty()) {
    for (std::vector<double>& theta : est::prior_points(model, command.prior_spread))
      aim.prior.push_back({std::move(theta), aim.derivatives});
    return aim;
  }
  return Error{ErrorKind::invalid, fmt::format("--for {}: there is no such free parameter; say "
                                               "all, drop, or one of {}",
                                               command.aim, names)};
}

std::string take_aim(const PlanAim& aim, const est::Model& model, est::PlanOptions& options) {
  options.aim = aim.derivatives;
  options.prior = aim.prior;
  const std::size_t impossible = aim.prior.empty() ? 0 : est::leave_out_impossible(model, options);
  if (impossible + aim.without_drop == 0) return {};
  std::string why;
  if (aim.without_drop > 0)
    why = fmt::format("{} {} no drop", aim.without_drop, aim.without_drop == 1 ? "has" : "have");
  if (impossible > 0)
    why += fmt::format("{}{} allow{} no run that the others allow too on this rig",
                       why.empty() ? "" : ", ", impossible, impossible == 1 ? "s" : "");
  return fmt::format(
      "{} of the {} dampers that the prior allows are left out of the plan: {}. The plan serves "
      "{}; "
      "a smaller --prior-spread keeps more",
      impossible + aim.without_drop, aim.prior.size() + aim.without_drop, why,
      options.prior.empty() ? std::string("the model's starts alone")
                            : fmt::format("the other {}", options.prior.size()));
}

void print_aim(const est::Plan& plan, const PlanAim& aim, std::size_t dampers) {
  if (aim.derivatives.empty()) return;
  std::vector<std::vector<std::string>> rows = {{"runs", "half of 95 % of " + aim.label}};
  for (const est::PlanSet& set : plan.sets)
    rows.push_back({report::names_of(plan, set), aim_percent(aim, set)});
  for (const est::PlanSet& set : plan.by_volume)
    rows.push_back({"best for the volume: " + report::names_of(plan, set), aim_percent(aim, set)});
  fmt::print("{}\n", report::text_table(rows, {false, true}));
  if (dampers > 0)
    fmt::print("Of each set: the median over {} dampers that the prior allows.\n\n", dampers);
}

void add_aim(const est::Plan& plan, const PlanAim& aim, OrderedJson& json) {
  if (aim.derivatives.empty()) return;
  const auto entries = [&](const std::vector<est::PlanSet>& sets) {
    OrderedJson out = OrderedJson::array();
    for (const est::PlanSet& set : sets)
      out.push_back({{"runs", report::names_of(plan, set)},
                     {"cycles", set.cycles},
                     {"share", set.share},
                     {"determined", set.determined},
                     {"standard_error", set.aim_error},
                     {"over_prior", set.aim_over_prior}});
    return out;
  };
  json["aim"] = {{"label", aim.label},
                 {"unit", aim.unit},
                 {"value", aim.value},
                 {"sets", entries(plan.sets)},
                 {"by_volume", entries(plan.by_volume)}};
}

}  // namespace shaker::cli
