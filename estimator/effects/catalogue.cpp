#include "estimator/effects/catalogue.hpp"

#include <array>

namespace shaker::estimator {

std::span<const Effect* const> catalogue() {
  static const std::array<const Effect*, 6> effects = {
      &orifice_damping(),  &gas_spring(),      &gravity(),
      &linear_stiffness(), &cubic_stiffness(), &viscous_damping(),
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
