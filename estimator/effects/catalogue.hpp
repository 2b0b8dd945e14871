// All effects that there are, by name. A new effect is one file here and one row in catalogue.cpp.
#pragma once

#include <span>
#include <string_view>

#include "estimator/effects/effect.hpp"

namespace shaker::estimator {

std::span<const Effect* const> catalogue();

// nullptr when there is none of that name.
const Effect* find_effect(std::string_view name);

// One function a file; each returns the effect's only instance, which lives as long as the program.
const Effect& orifice_damping();
const Effect& cubic_stiffness();
const Effect& gas_spring();
const Effect& gravity();
const Effect& linear_stiffness();
const Effect& viscous_damping();
const Effect& presliding_friction();
const Effect& pressure_friction();
const Effect& exciter_gain();
const Effect& sensor_gain();
const Effect& sensor_delay();

}  // namespace shaker::estimator
