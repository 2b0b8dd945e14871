#include "estimator/drop/drop_rule.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

namespace shaker::estimator {
namespace {

constexpr double kRuleInch = 0.0254, kRuleFoot = 0.3048;                // m, exact
constexpr double kPoundPerFoot2 = 4.4482216152605 / (0.3048 * 0.3048);  // Pa
constexpr int kMostRuleDrops = 60;
constexpr double kSettledDescent = 1e-12;  // relative

enum class HeightBy { speed, wing_loading, sinking };

struct RuleRow {
  std::string_view rule;
  HeightBy by;
  double least_height, most_height;  // inches; most 0: no upper end
  double most_lift, reserve_lift;    // of the weight
  double reserve_height;             // times h
  std::string_view lift_source, reserve_source;
};
constexpr RuleRow kRuleRows[] = {
    {"25.723", HeightBy::speed, 0, 0, 1.0, 1.0, 1.0, "25.473", "25.723(b)"},
    {"23.725", HeightBy::wing_loading, 9.2, 18.7, 0.667, 1.0, 1.44, "23.725(b)", "23.727(b)"},
    {"27.725", HeightBy::sinking, 8, 13, 2.0 / 3.0, 1.0, 1.5, "27.473(a)", "27.727(b)"},
    {"29.725", HeightBy::sinking, 8, 0, 2.0 / 3.0, 1.0, 1.5, "29.473(a)", "29.727(b)"},
};

Error refused_by_rule(std::string why) {
  return {ErrorKind::invalid, std::move(why)};
}

// A height in inches inside the rule's range; `remark` says where it was not. `by`: what asks for it.
double inside_of(const RuleRow& row, double inches, const std::string& by, std::string& remark) {
  const bool open = !(row.most_height > 0.0);
  const double taken = open ? std::max(inches, row.least_height)
                            : std::clamp(inches, row.least_height, row.most_height);
  if (taken != inches)
    remark = fmt::format(
        "{} asks for a height of {:.4g} in; {} drops from {}, so {:g} in is taken: "
        "check the number and its unit",
        by, inches, row.rule,
        open ? fmt::format("at least {:g} in", row.least_height)
             : fmt::format("{:g} to {:g} in", row.least_height, row.most_height),
        taken);
  return taken;
}

Result<double> height_of(const RuleRow& row, const RuleData& data, std::string& remark) {
  switch (row.by) {
    case HeightBy::speed: {
      if (data.sink_speed)
        return refused_by_rule("25.723 sets the sink speed; leave --sink-speed out");
      if (data.wing_loading)
        return refused_by_rule("25.723 knows no wing loading; leave --wing-loading out");
      const double feet = data.condition == "reserve"    ? 12.0
                          : data.condition == "take-off" ? 6.0
                                                         : 10.0;
      return std::pow(feet * kRuleFoot, 2) / (2.0 * data.gravity);
    }
    case HeightBy::wing_loading: {
      if (data.sink_speed)
        return refused_by_rule(
            "23.725 sets the height by the wing loading; leave --sink-speed out");
      if (!data.wing_loading)
        return refused_by_rule("23.725 needs --wing-loading, for example \"18 lbf/ft^2\"");
      if (!(*data.wing_loading > 0.0) || !std::isfinite(*data.wing_loading))
        return refused_by_rule("the wing loading must be above 0");
      const double inches = 3.6 * std::sqrt(*data.wing_loading / kPoundPerFoot2);
      return kRuleInch * inside_of(row, inches, "the wing loading", remark);
    }
    case HeightBy::sinking:
      break;
  }
  if (data.wing_loading)
    return refused_by_rule(
        fmt::format("{} knows no wing loading; leave --wing-loading out", row.rule));
  if (data.sink_speed && !(*data.sink_speed > 0.0))
    return refused_by_rule("the sink speed must be above 0");
  if (!data.sink_speed)
    return kRuleInch * (row.most_height > 0.0 ? row.most_height : row.least_height);
  const double inches = *data.sink_speed * *data.sink_speed / (2.0 * data.gravity) / kRuleInch;
  return kRuleInch *
         inside_of(row, inches, fmt::format("a sink speed of {:g} m/s", *data.sink_speed), remark);
}

Result<double> lift_by(const RuleRow& row, const RuleData& data) {
  const bool reserve = data.condition == "reserve";
  const double most = reserve ? row.reserve_lift : row.most_lift;
  const double lift = data.lift.value_or(most);
  // Reserve by 23.727: W_e = W h / (h + d), which is L = 1.
  if (row.rule == "23.725" && reserve && lift != 1.0)
    return refused_by_rule(
        "23.727(b) sets W_e = W h / (h + d), a lift ratio of 1; leave --lift out");
  if (lift >= 0.0 && lift <= most) return lift;
  return refused_by_rule(fmt::format("{} allows a lift of 0 to {:.4g} of the weight, not {:g}",
                                     reserve ? row.reserve_source : row.lift_source, most, lift));
}

// d with W_e(d) by the secant method, from the descent of the whole weight.
Result<void> iterate(RuleDrop& drop, const DescentOfDrop& descent) {
  const auto effective = [&](double d) {
    return drop.weight * (drop.height + (1.0 - drop.lift) * d) / (drop.height + d);
  };
  double last = 0.0, last_miss = 0.0, d = 0.0;
  for (drop.drops = 0; drop.drops < kMostRuleDrops;) {
    const double weight = drop.drops == 0 ? drop.weight : effective(d);
    const auto found = descent(weight, drop.sink_speed, 0.0);
    ++drop.drops;
    if (!found) return found.error();
    if (drop.drops == 1) {
      d = *found;
      continue;
    }
    const double miss = *found - d;
    double next = *found;
    if (drop.drops > 2 && miss != last_miss) next = d - miss * (d - last) / (miss - last_miss);
    if (!(next > 0.0)) next = *found;
    last = d;
    last_miss = miss;
    d = next;
    if (std::fabs(d - last) <= kSettledDescent * d) break;
  }
  drop.descent = d;
  drop.effective_weight = effective(d);
  return {};
}

}  // namespace

double RuleDrop::load_factor(double deceleration) const {
  const double developed = 1.0 + deceleration / gravity;
  return free_drop ? developed * effective_weight / weight + lift : developed;
}

Result<RuleDrop> drop_by_rule(const RuleData& given, const DescentOfDrop& descent) {
  RuleData data = given;
  if (data.condition.empty()) data.condition = "design";
  const auto* row = std::find_if(std::begin(kRuleRows), std::end(kRuleRows),
                                 [&](const RuleRow& each) { return each.rule == data.rule; });
  if (row == std::end(kRuleRows))
    return refused_by_rule(fmt::format(
        "there is no rule \"{}\"; there are 25.723, 23.725, 27.725 and 29.725", data.rule));
  if (data.condition != "design" && data.condition != "reserve" &&
      !(data.condition == "take-off" && row->by == HeightBy::speed))
    return refused_by_rule(fmt::format("{} has no condition \"{}\"; it has design{} and reserve",
                                       row->rule, data.condition,
                                       row->by == HeightBy::speed ? ", take-off" : ""));
  if (!(data.weight > 0.0) || !std::isfinite(data.weight))
    return refused_by_rule("the weight on the gear must be above 0");
  if (!(data.gravity > 0.0))
    return refused_by_rule("the model has no gravity; a rule's drop needs one");
  RuleDrop drop;
  const auto height = height_of(*row, data, drop.remark);
  if (!height) return height.error();
  const auto lift = lift_by(*row, data);
  if (!lift) return lift.error();
  drop.rule = data.rule;
  drop.condition = data.condition;
  drop.height = *height * (data.condition == "reserve" ? row->reserve_height : 1.0);
  drop.sink_speed = std::sqrt(2.0 * data.gravity * drop.height);
  drop.weight = drop.effective_weight = data.weight;
  drop.lift = *lift;
  drop.gravity = data.gravity;
  drop.free_drop = row->by != HeightBy::speed;
  if (drop.free_drop) {
    if (auto found = iterate(drop, descent); !found) return found.error();
    return drop;
  }
  const auto found = descent(drop.weight, drop.sink_speed, drop.lift);
  if (!found) return found.error();
  drop.descent = *found;
  drop.drops = 1;
  return drop;
}

}  // namespace shaker::estimator
