/// \file
/// All effects by name. A new effect is one file here and one row in catalogue.cpp.
#pragma once

#include <span>
#include <string_view>

#include "estimator/model/effects/effect.hpp"

namespace shaker::config {
struct EffectSpec;
}

namespace shaker::estimator {

/// \return all effects, in a fixed order; they live as long as the program
std::span<const Effect* const> catalogue();

/// Finds an effect by its name.
/// \param name name of the effect in model files
/// \return the effect, or nullptr if none has that name
const Effect* find_effect(std::string_view name);
/// Finds the effect of a line of a model.
/// \param line of a model file
/// \return the effect, as a part in series if the line says so, or nullptr if none has that name
const Effect* find_effect(const config::EffectSpec& line);
/// Tells parts of the load path from forces beside it.
/// \param line of a model file
/// \return true if all load goes through it: a play, or a joint that yields
bool is_in_series(const config::EffectSpec& line);

/// The effect of the damper with this name: one function for each file.
/// \return the only instance, which lives as long as the program
/// @{
const Effect& orifice_damping();
const Effect& gas_spring();
const Effect& gravity();
const Effect& coulomb_friction();
const Effect& pressure_friction();
const Effect& stribeck_friction();
const Effect& pinched_friction();
const Effect& presliding_friction();
const Effect& bouc_wen_hysteresis();
const Effect& viscous_damping();
const Effect& one_sided_damping();
const Effect& stroke_damping();
const Effect& digressive_damping();
const Effect& power_damping();
const Effect& laminar_orifice();
const Effect& rebound_damping();
const Effect& metering_pin();
const Effect& tabulated_pin();
const Effect& relief_valve();
const Effect& oil_compressibility();
const Effect& gas_heat_transfer();
const Effect& dissolved_gas();
const Effect& real_gas();
const Effect& second_chamber();
const Effect& end_stop();
const Effect& free_play();
const Effect& cavitation();
const Effect& linear_stiffness();
const Effect& quadratic_stiffness();
const Effect& cubic_stiffness();
const Effect& quintic_stiffness();
const Effect& added_mass();
const Effect& series_compliance();
const Effect& tyre();
/// @}

/// The effect of the exciter with this name: one function for each file.
/// \return the only instance, which lives as long as the program
/// @{
const Effect& exciter_gain();
const Effect& exciter_phase();
const Effect& exciter_delay();
const Effect& exciter_distortion();
/// @}

/// The effect of the instrument with this name: one function for each file (instrument/).
/// \return the only instance, which lives as long as the program
/// @{
const Effect& sensor_gain();
const Effect& sensor_offset();
const Effect& sensor_delay();
const Effect& sensor_lag();
const Effect& sensor_quantisation();
const Effect& sensor_nonlinearity();
const Effect& sensor_drift();
/// @}

}  // namespace shaker::estimator
