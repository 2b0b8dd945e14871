#include "cli/drop_setup.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "base/unit.hpp"
#include "cli/drop_figures.hpp"
#include "cli/quantity.hpp"

namespace shaker::cli {
namespace {

using estimator::DropTest;
using estimator::kDropFigureCount;
using estimator::kDropFigures;

Error set_up_refused(std::string why) {
  return {ErrorKind::invalid, std::move(why)};
}

Result<void> expect_metres(const config::ModelSpec& damper, const char* option) {
  if (damper.length_unit == "m") return {};
  return set_up_refused(fmt::format("{} needs a model that counts in m, but this one counts in {}",
                                    option, damper.length_unit));
}

Result<void> read_tyre(const DropOptions& options, const config::ModelSpec& damper,
                       DropSetup& setup) {
  if (!options.tyre_stiffness) {
    if (options.tyre_damping || options.unsprung_mass)
      return set_up_refused("a tyre needs --tyre-stiffness, in N/m");
    return {};
  }
  if (auto good = expect_metres(damper, "--tyre-stiffness"); !good) return good;
  if (!options.unsprung_mass)
    return set_up_refused("a tyre needs --unsprung-mass, in kg: wheel, axle and piston on it");
  setup.tyre = {*options.tyre_stiffness, options.tyre_damping.value_or(0.0),
                *options.unsprung_mass};
  return {};
}

Result<void> set_up_by_hand(const DropOptions& options, const config::ModelSpec& damper,
                            DropSetup& setup) {
  if (!options.sink_speed)
    return set_up_refused(
        "how does it fall? give --sink-speed V in m/s, or --rule RULE with --weight");
  if (!options.weight.empty() || !options.wing_loading.empty() || !options.condition.empty())
    return set_up_refused("--weight, --wing-loading and --condition belong to a --rule");
  if (options.mass) {
    if (auto good = expect_metres(damper, "--mass"); !good) return good;
  }
  if (setup.tyre && !options.mass)
    return set_up_refused("with a tyre, --mass is needed: the mass above the damper, in kg");
  if (options.shaker_mass && !options.mass)
    return set_up_refused("--shaker-mass changes nothing without --mass, the mass that falls");
  setup.conditions.sink_speed = *options.sink_speed;
  setup.conditions.lift = options.lift.value_or(0.0);
  setup.mass = options.mass;
  if (options.shaker_mass) setup.ratio = *options.mass / *options.shaker_mass;
  return {};
}

// The mass above the damper when `weight` falls.
Result<void> put_weight(double weight, double gravity, double unsprung, double shaker_mass,
                        DropSetup& setup) {
  const double sprung = weight / gravity - unsprung;
  if (!(sprung > 0.0))
    return set_up_refused(
        fmt::format("the weight of {:.6g} N is not above that of the unsprung mass of {:.6g} kg",
                    weight, unsprung));
  setup.mass = sprung;
  setup.ratio = sprung / shaker_mass;
  return {};
}

Result<estimator::RuleData> rule_data(const DropOptions& options, double gravity) {
  estimator::RuleData data;
  data.rule = options.rule;
  data.condition = options.condition;
  data.lift = options.lift;
  data.sink_speed = options.sink_speed;
  data.gravity = gravity;
  if (options.weight.empty())
    return set_up_refused("a rule needs --weight: the static weight on the gear, e.g. \"12kN\"");
  const auto weight = quantity("--weight", options.weight, Dimension::force);
  if (!weight) return weight.error();
  data.weight = *weight;
  if (options.wing_loading.empty()) return data;
  const auto loading = quantity("--wing-loading", options.wing_loading, Dimension::pressure);
  if (!loading) return loading.error();
  data.wing_loading = *loading;
  return data;
}

Result<void> set_up_by_rule(const DropOptions& options, const config::ModelSpec& damper,
                            DropSetup& setup) {
  if (auto good = expect_metres(damper, "--rule"); !good) return good;
  if (options.mass)
    return set_up_refused("by a rule, the mass follows from --weight; leave --mass out");
  if (!options.shaker_mass)
    return set_up_refused(
        "by a rule, --shaker-mass is needed: the mass in kg that the damper carried on the shaker");
  const auto kinds = estimator::line_kinds(damper);
  const bool weighs =
      std::find(kinds.begin(), kinds.end(), estimator::LineKind::weight) != kinds.end();
  const auto data = rule_data(options, weighs ? damper.gravity : 0.0);
  if (!data) return data.error();
  const double unsprung = setup.tyre ? setup.tyre->unsprung_mass
                                     : estimator::unsprung_share(damper) * *options.shaker_mass;
  const auto descent = [&](double weight, double speed, double lift) -> Result<double> {
    if (auto good = put_weight(weight, damper.gravity, unsprung, *options.shaker_mass, setup);
        !good)
      return good.error();
    setup.conditions.sink_speed = speed;
    setup.conditions.lift = lift;
    const DropTest test(setup.falling(damper), setup.conditions);
    const auto run = test.run(test.model().start(), false);
    if (!run) return run.error();
    const double travel = run->figures[figure_called("travel")];
    if (std::isfinite(travel)) return travel;
    return Error{ErrorKind::not_converged,
                 "the mass is still sinking at the end; give a longer --duration"};
  };
  auto rule = estimator::drop_by_rule(*data, descent);
  if (!rule) return rule.error();
  setup.conditions.sink_speed = rule->sink_speed;
  setup.conditions.lift = rule->acting_lift();
  setup.rule = std::move(*rule);
  return put_weight(setup.rule->effective_weight, damper.gravity, unsprung, *options.shaker_mass,
                    setup);
}

std::string names_of_limits() {
  std::string names = "load_factor";
  for (const auto& figure : kDropFigures) {
    if (figure.length != 2 && std::string_view(figure.name) != "efficiency" &&
        figure.name != kMarginFigure)
      names += fmt::format(", {}", figure.name);
  }
  return names;
}

Result<void> read_stroke_limit(const DropOptions& options, const config::ModelSpec& damper,
                               DropSetup& setup) {
  if (options.stroke_limit.empty()) return {};
  const auto metre = unit_called(damper.length_unit, Dimension::length);
  if (!metre)
    return set_up_refused(fmt::format(
        "--stroke-limit: the model's length unit {} is unknown, so it cannot be converted",
        damper.length_unit));
  const auto stroke = quantity("--stroke-limit", options.stroke_limit, Dimension::length);
  if (!stroke) return stroke.error();
  setup.conditions.stroke_limit = *stroke / metre->scale;
  return {};
}

// One value of charge, oil or temperature is the state in which it falls; a range is for the
// servicing envelope.
Result<void> read_state(const DropOptions& options, DropSetup& setup) {
  setup.tested_temperature = options.tested_temperature.value_or(setup.tested_temperature);
  const auto one = [](const std::vector<double>& given, double& value) {
    if (given.size() == 1) value = given[0];
  };
  double degrees = setup.tested_temperature;
  one(options.charge, setup.state.charge);
  one(options.oil, setup.state.oil);
  one(options.temperature, degrees);
  setup.state.temperature = degrees - setup.tested_temperature;
  const estimator::ServicingState& s = setup.state;
  return estimator::check_ranges(
      {{s.charge, s.charge}, {s.oil, s.oil}, {s.temperature, s.temperature}, setup.kelvin()});
}

// The value of a limit in the units of `figure`.
Result<double> limit_value(const DropLimit& limit, const config::ModelSpec& damper,
                           const std::optional<double>& mass) {
  const auto& figure = kDropFigures[limit.figure];
  const std::string text = limit.text.substr(limit.text.find('=') + 1);
  const std::string what = "--limit " + limit.name;
  const auto metre = unit_called(damper.length_unit, Dimension::length);
  if (figure.length == 0) return quantity(what, text, Dimension::time);
  if (!metre)
    return set_up_refused(
        fmt::format("{}: the model's length unit {} is unknown, so it cannot be converted", what,
                    damper.length_unit));
  const bool is_load = figure_unit(limit.figure, "m", true) == "N";
  const auto dimension = figure.time == 0    ? Dimension::length
                         : figure.time == -1 ? Dimension::speed
                         : is_load           ? Dimension::force
                                             : Dimension::acceleration;
  const auto value = quantity(what, text, dimension);
  if (!value) return value.error();
  if (!is_load) return *value / metre->scale;
  if (mass) return *value / *mass / metre->scale;
  return set_up_refused(what + ": a load needs --mass, the mass above the damper, in kg");
}

// A load factor bounds the deceleration, in which it is linear.
Result<double> deceleration_at(const std::string& text, const DropSetup& setup, double gravity) {
  double factor = 0.0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), factor);
  if (read.ec != std::errc() || read.ptr != text.data() + text.size() || !std::isfinite(factor))
    return set_up_refused(
        fmt::format("--limit load_factor={}: say a number without a unit, for example 2.5", text));
  if (!(gravity > 0.0)) return set_up_refused("--limit load_factor: the model has no gravity");
  if (!setup.rule) return (factor - 1.0) * gravity;
  const double at_rest = setup.rule->load_factor(0.0);
  return (factor - at_rest) / (setup.rule->load_factor(1.0) - at_rest);
}

Result<DropLimit> read_limit(const std::string& text, const DropSetup& setup,
                             const config::ModelSpec& damper) {
  DropLimit limit;
  limit.text = text;
  const auto equals = text.find('=');
  limit.name = text.substr(0, equals);
  if (equals == std::string::npos || equals + 1 == text.size())
    return set_up_refused(
        fmt::format("--limit {}: say FIGURE=VALUE with a unit, for example peak_load=120kN", text));
  if (limit.name == "load_factor") {
    limit.figure = figure_called("peak_deceleration");
    const auto value = deceleration_at(text.substr(equals + 1), setup, damper.gravity);
    if (!value) return value.error();
    limit.value = *value;
    return limit;
  }
  limit.figure = figure_called(limit.name);
  if (limit.name == kMarginFigure)
    return set_up_refused(fmt::format(
        "--limit {}: a margin is no upper limit; give --stroke-limit with the greatest stroke, and "
        "the probability of bottoming is printed",
        limit.name));
  if (limit.figure == kDropFigureCount || kDropFigures[limit.figure].length == 2 ||
      limit.name.ends_with("efficiency"))
    return set_up_refused(fmt::format("--limit {}: there is no such limit; there are {}",
                                      limit.name, names_of_limits()));
  const auto value = limit_value(limit, damper, setup.mass);
  if (!value) return value.error();
  if (!(*value > 0.0))
    return set_up_refused(
        fmt::format("--limit {}: an upper limit must be above 0, for no drop stays "
                    "below it",
                    text));
  limit.value = *value;
  return limit;
}

}  // namespace

config::ModelSpec DropSetup::falling(const config::ModelSpec& model) const {
  auto spec = estimator::with_mass(model, ratio);
  if (!state.as_tested()) spec = estimator::in_state(std::move(spec), state, kelvin());
  return tyre ? estimator::on_tyre(std::move(spec), *tyre, *mass) : spec;
}

estimator::DamperHypothesis DropSetup::falling(estimator::DamperHypothesis hypothesis) const {
  estimator::IdentifiedDamper damper;
  damper.hypotheses.push_back(std::move(hypothesis));
  return falling(damper).hypotheses.front();
}

estimator::IdentifiedDamper DropSetup::falling(const estimator::IdentifiedDamper& damper) const {
  auto out = estimator::with_mass(damper, ratio);
  if (!state.as_tested()) out = estimator::in_state(std::move(out), state, kelvin());
  for (auto& h : out.hypotheses) {
    if (tyre) h.model = estimator::on_tyre(std::move(h.model), *tyre, *mass);
  }
  return out;
}

double DropSetup::kelvin() const {
  constexpr double kIcePoint = 273.15;
  return tested_temperature + kIcePoint;
}

Result<DropSetup> set_up_drop(const DropOptions& options, const config::ModelSpec& damper) {
  DropSetup setup;
  setup.conditions.duration = options.duration;
  if (auto good = read_tyre(options, damper, setup); !good) return good.error();
  if (auto good = read_stroke_limit(options, damper, setup); !good) return good.error();
  if (auto good = read_state(options, setup); !good) return good.error();
  auto good = options.rule.empty() ? set_up_by_hand(options, damper, setup)
                                   : set_up_by_rule(options, damper, setup);
  if (!good) return good.error();
  for (const std::string& text : options.limits) {
    auto limit = read_limit(text, setup, damper);
    if (!limit) return limit.error();
    setup.limits.push_back(std::move(*limit));
  }
  return setup;
}

}  // namespace shaker::cli
