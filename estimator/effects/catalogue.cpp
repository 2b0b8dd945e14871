#include "estimator/effects/catalogue.hpp"

#include <array>

namespace shaker::estimator {

std::span<const Effect* const> catalogue() {
  static const std::array<const Effect*, 11> effects = {
      // of the damper
      &orifice_damping(),
      &gas_spring(),
      &gravity(),
      &linear_stiffness(),
      &cubic_stiffness(),
      &viscous_damping(),
      &presliding_friction(),
      &pressure_friction(),
      // of the exciter
      &exciter_gain(),
      // of the instrument
      &sensor_gain(),
      &sensor_delay(),
  };
  return effects;
}

const Effect* find_effect(std::string_view name) {
  for (const Effect* effect : catalogue()) {
    if (effect->name() == name) return effect;
  }
  return nullptr;
}

}  // namespace shaker::estimator
