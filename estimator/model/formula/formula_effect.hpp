// An effect that a model file defines by a formula, with internal states if it has memory:
//
//   {"effect": "my_seal", "formula": "f_c * z / z0",
//    "states": {"z": {"rate": "v - smooth_abs(v, e) * z / z0"}},
//    "parameters": {"f_c": {"start": 0.3, "lower": 0, "unit": "m/s^2"}, "z0": {"start": 5e-4}},
//    "constants": {"e": 0.001}}
//
// Names in a formula: u, v, a (stroke, velocity and acceleration that the effect sees), x
// (excitation), the effect's states, parameters and constants, and borrowed parameters
// ("borrows": {"theta2": "gas_spring"}). The partial derivatives are symbolic and exact.
#pragma once

#include <memory>

#include "config/model.hpp"
#include "estimator/model/effects/effect.hpp"

namespace shaker::estimator {

// Throws std::invalid_argument that names the formula, the column and what is allowed. It may
// wait for a FormulaLock.
std::shared_ptr<const Effect> make_formula_effect(const config::EffectSpec& spec);

}  // namespace shaker::estimator
