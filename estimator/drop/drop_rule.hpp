// The conditions of a drop test by the airworthiness rules: 14 CFR 25.723 with 25.473, 23.725 with
// 23.727 (as amended up to 23-48), 27.725 with 27.727, 29.725 with 29.727.
//
//   25.723  10 ft/s at the design landing weight, 6 ft/s at the take-off weight; reserve 12 ft/s.
//           The lift acts as a force, at most the weight.
//   23.725  h = 3.6 sqrt(W / S) inches, W / S in lb/ft^2, from 9.2 to 18.7; reserve 1.44 h, L = 1.
//   27.725  h = 13 inches, or that of the greatest probable sinking speed, from 8 to 13; reserve 1.5 h.
//   29.725  h = that of the sinking speed, at least 8 inches; reserve 1.5 h.
//
// In 23, 27 and 29 an effective weight takes the place of the lift: W_e = W (h + (1 - L) d) / (h + d)
// falls freely, where d is the descent of the mass after touch-down. d is that of the drop itself,
// so W_e and d are iterated. The load factor is n = n_j W_e / W + L with n_j = 1 + deceleration / g.
//
// SI units. Pure but for the drops that `descent` makes.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "base/result.hpp"

namespace shaker::estimator {

struct RuleData {
  std::string rule;                    // "25.723", "23.725", "27.725", "29.725"
  std::string condition;               // "design", "take-off", "reserve"; empty: design
  double weight = 0.0;                 // N: static, on this gear
  std::optional<double> wing_loading;  // Pa
  std::optional<double> lift;          // share of the weight; empty: the most that the rule allows
  std::optional<double> sink_speed;    // m/s: greatest probable, for rotorcraft
  double gravity = 9.80665;            // m/s^2
};

struct RuleDrop {
  std::string rule, condition;
  double height = 0.0;                          // m: of a free drop to the same sink speed
  double sink_speed = 0.0;                      // m/s
  double weight = 0.0, effective_weight = 0.0;  // N; equal where the lift acts as a force
  double lift = 0.0;                            // of the rule
  bool free_drop = false;                       // with the effective weight and without lift
  double descent = 0.0;                         // m: d of the drop
  int drops = 0;                                // that the iteration took
  double gravity = 9.80665;
  std::string remark;  // where the data ask for a height beyond the rule's; otherwise empty

  double acting_lift() const { return free_drop ? 0.0 : lift; }
  // n, of a deceleration of the mass above the damper (m/s^2). Linear in it.
  double load_factor(double deceleration) const;
};

// The descent (m) of the mass after touch-down, of a drop of `weight` (N) with `sink_speed` (m/s) and
// a lift as a share of `weight`.
using DescentOfDrop = std::function<Result<double>(double weight, double sink_speed, double lift)>;

// An Error names what the rule lacks or what is outside of its range, or is that of `descent`.
Result<RuleDrop> drop_by_rule(const RuleData& data, const DescentOfDrop& descent);

}  // namespace shaker::estimator
