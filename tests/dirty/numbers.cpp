// Where each parameter of the catalogue's text is kept in a device.
#include <stdexcept>

#include "tests/dirty/device.hpp"

namespace shaker::dirty {
namespace {

struct Place {
  const char* effect;  // "": of the base
  const char* parameter;
  double Numbers::*number;
};

constexpr Place kPlaces[] = {
    {"", "theta1", &Numbers::theta1},
    {"", "theta2", &Numbers::theta2},
    {"", "theta3", &Numbers::theta3},
    {"", "theta4", &Numbers::theta4},
    {"", "c", &Numbers::c},
    {"", "k", &Numbers::k},
    {"coulomb_friction", "f_c", &Numbers::coulomb},
    {"pressure_friction", "mu", &Numbers::pressed},
    {"stribeck_friction", "f_c", &Numbers::peak_f},
    {"stribeck_friction", "ratio", &Numbers::peak_ratio},
    {"stribeck_friction", "v_s", &Numbers::peak_v},
    {"presliding_friction", "f_c", &Numbers::dahl_f},
    {"presliding_friction", "z0", &Numbers::dahl_z0},
    {"bouc_wen_hysteresis", "k", &Numbers::wen_k},
    {"bouc_wen_hysteresis", "b", &Numbers::wen_b},
    {"bouc_wen_hysteresis", "c", &Numbers::wen_c},
    {"bouc_wen_hysteresis", "n", &Numbers::wen_n},
    {"viscous_damping", "c", &Numbers::viscous},
    {"orifice_damping", "theta1", &Numbers::drag},
    {"laminar_orifice", "v_c", &Numbers::laminar_v},
    {"rebound_damping", "r", &Numbers::rebound},
    {"metering_pin", "k1", &Numbers::pin1},
    {"metering_pin", "k2", &Numbers::pin2},
    {"relief_valve", "f_rel", &Numbers::relief_f},
    {"relief_valve", "k", &Numbers::relief_k},
    {"cavitation", "f_cav", &Numbers::cavitation_f},
    {"oil_compressibility", "k_o", &Numbers::oil_k},
    {"oil_compressibility", "q_l", &Numbers::oil_leak},
    {"gas_heat_transfer", "tau", &Numbers::heat_tau},
    {"dissolved_gas", "s", &Numbers::solubility},
    {"dissolved_gas", "tau", &Numbers::solution_tau},
    {"real_gas", "beta", &Numbers::real},
    {"second_chamber", "kappa", &Numbers::second_share},
    {"second_chamber", "u_k", &Numbers::second_u},
    {"end_stop", "k", &Numbers::stop_k},
    {"end_stop", "d", &Numbers::stop_d},
    {"end_stop", "u_s", &Numbers::stop_u},
    {"free_play", "delta", &Numbers::play},
    {"free_play", "k", &Numbers::play_k},
    {"linear_stiffness", "k", &Numbers::spring_k},
    {"linear_stiffness", "u0", &Numbers::spring_u0},
    {"cubic_stiffness", "k3", &Numbers::cubic_k},
    {"cubic_stiffness", "u0", &Numbers::cubic_u0},
    {"added_mass", "m_a", &Numbers::added_mass},
    {"series_compliance", "k_n", &Numbers::joint_k},
    {"tyre", "r", &Numbers::tyre_r},
    {"tyre", "k_t", &Numbers::tyre_k},
    {"tyre", "c_t", &Numbers::tyre_c},
    {"sensor_gain", "G", &Numbers::gain},
    {"sensor_nonlinearity", "n2", &Numbers::bend2},
    {"sensor_nonlinearity", "n3", &Numbers::bend3},
    {"sensor_lag", "tau", &Numbers::lag},
    {"sensor_drift", "d", &Numbers::drift},
    {"cogging", "size", &Numbers::cogging},
    {"cogging", "length", &Numbers::cogging_length},
    {"cogging", "u", &Numbers::cogging_u},
    {"bearing_tilt", "size", &Numbers::tilt},
    {"bearing_tilt", "u", &Numbers::tilt_u},
    {"maxwell_bush", "size", &Numbers::bush},
    {"maxwell_bush", "tau", &Numbers::bush_tau},
    {"fading_oil", "size", &Numbers::fading},
    {"fading_oil", "tau", &Numbers::fading_tau},
    {"appendage", "size", &Numbers::appendage},
    {"appendage", "omega", &Numbers::appendage_omega},
    {"appendage", "damping", &Numbers::appendage_damping},
};

// Effects of the channels and of the table, which `motion` and `records` make.
bool elsewhere(const std::string& effect) {
  return effect == "sensor_delay" || effect == "sensor_quantisation" ||
         effect.starts_with("exciter_");
}

void put(Numbers& numbers, const std::string& effect, const std::string& parameter, double value) {
  for (const Place& place : kPlaces) {
    if (effect != place.effect || parameter != place.parameter) continue;
    numbers.*place.number = value;
    return;
  }
  if (!elsewhere(effect)) throw std::invalid_argument("no device has " + effect + "." + parameter);
}

}  // namespace

Device::Device(const std::map<std::string, double>& base, const Effects& effects, bool weight)
    : oleo_(base.contains("theta1")), weight_(weight) {
  for (const auto& [parameter, value] : base)
    put(n_, "", parameter, value);
  for (const auto& [effect, parameters] : effects)
    for (const auto& [parameter, value] : parameters)
      put(n_, effect, parameter, value);
}

}  // namespace shaker::dirty
