#include "estimator/model/effects/catalogue.hpp"

#include <array>

#include "config/model.hpp"

namespace shaker::estimator {

std::span<const Effect* const> catalogue() {
  static const auto effects = std::to_array<const Effect*>({
      // of the damper
      &orifice_damping(),
      &gas_spring(),
      &gravity(),
      &coulomb_friction(),
      &pressure_friction(),
      &stribeck_friction(),
      &pinched_friction(),
      &presliding_friction(),
      &bouc_wen_hysteresis(),
      &viscous_damping(),
      &one_sided_damping(),
      &stroke_damping(),
      &digressive_damping(),
      &power_damping(),
      &laminar_orifice(),
      &rebound_damping(),
      &metering_pin(),
      &tabulated_pin(),
      &relief_valve(),
      &oil_compressibility(),
      &gas_heat_transfer(),
      &dissolved_gas(),
      &real_gas(),
      &second_chamber(),
      &end_stop(),
      &free_play(),
      &cavitation(),
      &linear_stiffness(),
      &quadratic_stiffness(),
      &cubic_stiffness(),
      &quintic_stiffness(),
      &added_mass(),
      &series_compliance(),
      &tyre(),
      // of the exciter
      &exciter_gain(),
      &exciter_phase(),
      &exciter_delay(),
      &exciter_distortion(),
      // of the instrument
      &sensor_gain(),
      &sensor_offset(),
      &sensor_delay(),
      &sensor_lag(),
      &sensor_quantisation(),
      &sensor_nonlinearity(),
      &sensor_drift(),
  });
  return effects;
}

const Effect* find_effect(std::string_view name) {
  name = config::driven(name).effect;
  for (const Effect* effect : catalogue()) {
    if (effect->name() == name) return effect;
  }
  return nullptr;
}

const Effect* find_effect(const config::EffectSpec& line) {
  const Effect* effect = find_effect(line.effect);
  return effect != nullptr && line.in_series ? &effect->as_part_in_series() : effect;
}

bool is_in_series(const config::EffectSpec& line) {
  const Effect* effect = find_effect(line);
  return effect != nullptr && effect->in_series();
}

}  // namespace shaker::estimator
