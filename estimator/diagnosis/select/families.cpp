#include "estimator/diagnosis/select/internal/families.hpp"

#include <algorithm>

#include "config/model.hpp"

namespace shaker::estimator::diagnosis {

std::span<const EffectKind> effect_kinds() {
  static const std::vector<EffectKind> all = {
      {"dry friction",
       {"coulomb_friction", "stribeck_friction", "pressure_friction", "pinched_friction",
        "presliding_friction", "bouc_wen_hysteresis"}},
      {"damping that follows the velocity",
       {"viscous_damping", "one_sided_damping", "stroke_damping", "digressive_damping",
        "power_damping", "orifice_damping", "laminar_orifice", "rebound_damping", "metering_pin",
        "tabulated_pin", "relief_valve", "cavitation"}},
      {"behaviour of the gas",
       {"gas_heat_transfer", "dissolved_gas", "real_gas", "second_chamber"}},
      {"stiffness that follows the stroke",
       {"linear_stiffness", "quadratic_stiffness", "cubic_stiffness", "quintic_stiffness",
        "end_stop"}},
      {"give in the load path", {"oil_compressibility", "series_compliance", "free_play"}}};
  return all;
}

const EffectKind* kind_of(std::string_view effect) {
  effect = config::driven(effect).effect;
  for (const EffectKind& kind : effect_kinds()) {
    if (std::find(kind.effects.begin(), kind.effects.end(), effect) != kind.effects.end())
      return &kind;
  }
  return nullptr;
}

}  // namespace shaker::estimator::diagnosis
