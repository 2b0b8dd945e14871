#include "estimator/model/effects/scaled.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

using config::MotionScale;

// 1 for what has no dimension, and for the unit of a formula.
double factor_of(std::string_view unit, bool coefficient, const MotionScale& s) {
  if (unit == "m") return s.length;
  if (unit == "m/s") return s.speed;
  if (unit == "m/s^2") return s.force;
  if (unit == "s") return s.length / s.speed;
  if (unit == "1/s") return s.force / s.speed;
  if (unit == "1/s^2") return s.force / s.length;
  if (unit == "1/(m s)") return s.force / (s.length * s.speed);
  if (unit == "1/(m s^2)") return s.force / std::pow(s.length, 2);
  if (unit == "1/(m^2 s^2)") return s.force / std::pow(s.length, 3);
  if (unit == "1/(m^4 s^2)") return s.force / std::pow(s.length, 5);
  if (unit == "1/m") return coefficient ? s.force / (s.speed * s.speed) : 1.0 / s.length;
  return 1.0;
}

}  // namespace

ParameterInfo scaled(const Effect& effect, const ParameterInfo& info, const MotionScale& scale) {
  // A delay of electronics is what it is, however fast the motion.
  if (scale == MotionScale{} || (info.unit == "s" && effect.group() != Group::damper)) return info;
  const double factor = &effect == &added_mass()
                            ? scale.inertia
                            : factor_of(info.unit, !std::isnan(info.absent), scale);
  ParameterInfo own = info;
  own.start *= factor;
  own.lower *= factor;
  own.upper *= factor;
  own.absent *= factor;
  return own;
}

ConstantInfo scaled(const ConstantInfo& info, const MotionScale& scale) {
  ConstantInfo own = info;
  if (info.width) own.value *= factor_of(info.unit, false, scale);
  if (info.reach && scale.reach > 0.0) own.value = scale.reach;
  return own;
}

ParameterInfo with_start_inside(const ParameterInfo& info, const config::ParameterSpec& stated) {
  constexpr double kRoom = 10.0;
  ParameterInfo own = info;
  if (!stated.start || info.unit == "-") return own;
  const double start = *stated.start;
  const bool small = start > 0.0 && start < info.lower,
             negative = start < info.lower && info.lower < 0.0;
  if (!stated.lower && (small || negative)) own.lower = small ? start / kRoom : start * kRoom;
  if (!stated.upper && start > info.upper && info.upper > 0.0) own.upper = start * kRoom;
  return own;
}

config::ModelSpec with_room(config::ModelSpec model, const MotionScale& scale) {
  for (config::EffectSpec& line : model.effects) {
    const Effect* effect = find_effect(line.effect);
    if (effect == nullptr || line.scale != MotionScale{}) continue;
    for (const ParameterInfo& info : effect->parameters()) {
      const std::string symbol(info.symbol);
      const auto said = line.parameters.find(symbol);
      const bool stated = said != line.parameters.end();
      const ParameterInfo own = with_start_inside(scaled(*effect, info, scale),
                                                  stated ? said->second : config::ParameterSpec());
      if (own.lower < info.lower && !(stated && said->second.lower))
        line.parameters[symbol].lower = own.lower;
      if (own.upper > info.upper && !(stated && said->second.upper))
        line.parameters[symbol].upper = own.upper;
    }
  }
  return model;
}

namespace {

void state_scaled(config::EffectSpec& line) {
  const Effect* effect = find_effect(line.effect);
  if (effect == nullptr || line.scale == MotionScale{}) return;
  for (const ParameterInfo& info : effect->parameters()) {
    const ParameterInfo own = scaled(*effect, info, line.scale);
    config::ParameterSpec& stated = line.parameters[std::string(info.symbol)];
    if (!stated.start) stated.start = own.start;
    if (!stated.lower && std::isfinite(own.lower)) stated.lower = own.lower;
    if (!stated.upper && std::isfinite(own.upper)) stated.upper = own.upper;
    // A start at a bound may have been rounded otherwise than the bound.
    stated.start = std::clamp(*stated.start, stated.lower.value_or(own.lower),
                              stated.upper.value_or(own.upper));
  }
  for (const ConstantInfo& info : effect->constants())
    if (info.width)
      line.constants.emplace(std::string(info.symbol), scaled(info, line.scale).value);
  line.scale = {};
}

}  // namespace

void state_scaled(config::ModelSpec& model) {
  for (config::EffectSpec& line : model.effects)
    state_scaled(line);
}

}  // namespace shaker::estimator
