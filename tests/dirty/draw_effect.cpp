#include "tests/dirty/draw_effect.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>

namespace shaker::dirty {
namespace {

using Parameters = std::map<std::string, double>;
using Draw = Parameters (*)(const Scales&, Random&);

struct Row {
  const char* name;
  const char* kinds;  // first letters of the kinds of data; capitals: of the oleo
  Draw draw;
};

// p, P: periodic; i, I: imposed motion; s, S: sweep; d: decay; D: drop.
const Row kRows[] = {
    {"coulomb_friction", "pPiIsSdD",
     [](const Scales& s, Random& r) {
       return Parameters{{"f_c", s.load * r.log_uniform(0.02, 0.2)}};
     }},
    {"pressure_friction", "PISD",
     [](const Scales&, Random& r) {
       return Parameters{{"mu", r.log_uniform(5e-3, 0.06)}};
     }},
    {"stribeck_friction", "pPiIsSdD",
     [](const Scales& s, Random& r) {
       return Parameters{{"f_c", s.load * r.log_uniform(0.02, 0.15)},
                         {"ratio", r.uniform(1.3, 2.0)},
                         {"v_s", std::clamp(s.speed * r.log_uniform(0.03, 0.3), 2e-3, 0.1)}};
     }},
    {"presliding_friction", "pPiIsSdD",
     [](const Scales& s, Random& r) {
       return Parameters{{"f_c", s.load * r.log_uniform(0.03, 0.2)},
                         {"z0", std::clamp(s.range() * r.log_uniform(0.005, 0.05), 2e-4, 5e-3)}};
     }},
    {"bouc_wen_hysteresis", "pPiIsSdD",
     [](const Scales& s, Random& r) {
       const double z0 = s.range() * r.log_uniform(0.05, 0.3), n = r.uniform(1.0, 2.0);
       const double b = 1.0 / std::pow(z0, n);
       return Parameters{{"k", s.load * r.log_uniform(0.05, 0.3) / z0},
                         {"b", b},
                         {"c", b * r.uniform(-0.5, 0.8)},
                         {"n", n}};
     }},
    {"viscous_damping", "PISD",
     [](const Scales& s, Random& r) {
       return Parameters{{"c", s.damping / s.speed * r.log_uniform(0.05, 0.5)}};
     }},
    {"orifice_damping", "pisd",
     [](const Scales& s, Random& r) {
       return Parameters{{"theta1", s.damping / s.speed / s.speed * r.log_uniform(0.1, 1.0)}};
     }},
    {"laminar_orifice", "PISD",
     [](const Scales& s, Random& r) {
       return Parameters{{"v_c", s.speed * r.log_uniform(0.05, 0.4)}};
     }},
    {"rebound_damping", "PISD",
     [](const Scales&, Random& r) {
       const double more = r.log_uniform(1.3, 5.0);
       return Parameters{{"r", r.sign() > 0.0 ? more : std::max(1.0 / more, 0.2)}};
     }},
    {"metering_pin", "PISD",
     [](const Scales&, Random& r) {
       return Parameters{{"k1", r.uniform(0.05, 0.4)}, {"k2", r.uniform(0.0, 0.3)}};
     }},
    {"relief_valve", "PISD",
     [](const Scales& s, Random& r) {
       return Parameters{{"f_rel", s.damping * r.uniform(0.2, 0.6)}, {"k", r.uniform(0.0, 0.5)}};
     }},
    {"cavitation", "PISD",
     [](const Scales& s, Random& r) {
       return Parameters{{"f_cav", s.damping * r.uniform(0.1, 0.6)}};
     }},
    {"oil_compressibility", "PISD",
     [](const Scales&, Random& r) {
       return Parameters{{"k_o", r.log_uniform(1e3, 4e3)}, {"q_l", 5e-3}};
     }},
    {"gas_heat_transfer", "PISD",
     [](const Scales&, Random& r) {
       return Parameters{{"tau", r.log_uniform(0.05, 2.0)}};
     }},
    {"dissolved_gas", "PISD",
     [](const Scales&, Random& r) {
       return Parameters{{"s", r.log_uniform(0.02, 0.2)}, {"tau", r.log_uniform(0.05, 2.0)}};
     }},
    {"real_gas", "PISD",
     [](const Scales&, Random& r) {
       return Parameters{{"beta", r.sign() * r.log_uniform(5e-3, 0.05)}};
     }},
    {"second_chamber", "PISD",
     [](const Scales& s, Random& r) {
       return Parameters{{"kappa", r.uniform(0.1, 0.5)},
                         {"u_k", s.low + s.range() * r.uniform(0.3, 0.7)}};
     }},
    {"end_stop", "pPiIsSdD",
     [](const Scales& s, Random& r) {
       return Parameters{{"k", 2.0 * s.load / s.range() * r.log_uniform(0.5, 20.0)},
                         {"d", s.damping / s.speed * r.uniform(0.0, 2.0)},
                         {"u_s", s.high - s.range() * r.uniform(0.05, 0.25)}};
     }},
    {"free_play", "psd",
     [](const Scales& s, Random& r) {
       return Parameters{{"delta", std::clamp(s.range() * r.log_uniform(0.01, 0.08), 5e-5, 2e-3)},
                         {"k", 1e4}};
     }},
    {"linear_stiffness", "PISD",
     [](const Scales& s, Random& r) {
       return Parameters{{"k", s.load / s.range() * r.log_uniform(0.05, 0.6)}, {"u0", s.middle()}};
     }},
    {"cubic_stiffness", "pPiIsSdD",
     [](const Scales& s, Random& r) {
       return Parameters{{"k3", 8.0 * s.load / std::pow(s.range(), 3) * r.log_uniform(0.05, 0.5)},
                         {"u0", s.middle()}};
     }},
    {"added_mass", "PISD",
     [](const Scales&, Random& r) {
       return Parameters{{"m_a", r.log_uniform(0.02, 0.2)}};
     }},
    {"series_compliance", "pPsS",
     [](const Scales&, Random& r) {
       return Parameters{{"k_n", r.log_uniform(1e3, 1e4)}};
     }},
    {"tyre", "pPsS",
     [](const Scales&, Random& r) {
       return Parameters{{"r", r.log_uniform(0.03, 0.2)},
                         {"k_t", r.log_uniform(2e3, 1e4)},
                         {"c_t", r.uniform(1.0, 10.0)}};
     }},
    {"sensor_gain", "PS",
     [](const Scales&, Random& r) {
       return Parameters{{"G", 1.0 + r.sign() * r.uniform(0.02, 0.1)}};
     }},
    {"sensor_delay", "pPsS",
     [](const Scales&, Random& r) {
       return Parameters{{"d", r.log_uniform(2e-3, 3e-2)}};
     }},
    {"sensor_lag", "pPsS",
     [](const Scales&, Random& r) {
       return Parameters{{"tau", r.log_uniform(2e-3, 5e-2)}};
     }},
    {"sensor_quantisation", "pPsSdD",
     [](const Scales& s, Random& r) {
       return Parameters{{"q", s.range() * r.log_uniform(0.01, 0.05)}};
     }},
    {"sensor_nonlinearity", "pPsSdD",
     [](const Scales&, Random& r) {
       return Parameters{{"n2", r.sign() * r.uniform(0.01, 0.1)},
                         {"n3", r.sign() * r.uniform(0.01, 0.1)}};
     }},
    {"sensor_drift", "pPsSd",
     [](const Scales& s, Random& r) {
       return Parameters{{"d", r.sign() * std::min(s.range() * r.log_uniform(2e-3, 3e-2), 0.01)}};
     }},
    {"exciter_gain", "pPsS",
     [](const Scales&, Random& r) {
       return Parameters{{"G", 1.0 + r.sign() * r.uniform(0.02, 0.1)}};
     }},
    {"exciter_phase", "pP",
     [](const Scales&, Random& r) {
       return Parameters{{"phi", r.sign() * r.uniform(0.02, 0.3)}};
     }},
    {"exciter_distortion", "pP",
     [](const Scales&, Random& r) {
       Parameters drawn;
       for (const char* h : {"2", "3", "4", "5"}) {
         drawn[std::string("a") + h] = r.uniform(-0.1, 0.1);
         drawn[std::string("b") + h] = r.uniform(-0.1, 0.1);
       }
       return drawn;
     }},
};

char letter(const std::string& kind, bool oleo) {
  if (kind == "drop") return 'D';
  if (kind == "decay") return 'd';
  const char* pair = kind == "periodic" ? "pP" : (kind == "imposed" ? "iI" : "sS");
  return pair[oleo ? 1 : 0];
}

}  // namespace

std::vector<std::string> candidates(const std::string& kind, bool oleo) {
  std::vector<std::string> names;
  for (const Row& row : kRows)
    if (std::string(row.kinds).find(letter(kind, oleo)) != std::string::npos)
      names.emplace_back(row.name);
  return names;
}

std::map<std::string, double> drawn_effect(const std::string& name, const Scales& scales,
                                           Random& random) {
  const auto* row = std::ranges::find_if(kRows, [&](const Row& r) { return name == r.name; });
  if (row == std::ranges::end(kRows)) throw std::invalid_argument("no draw of " + name);
  return row->draw(scales, random);
}

Effects drawn_unknown(const Scales& s, Random& random) {
  switch (random.below(5)) {
    case 0:
      return {{"cogging",
               {{"size", 0.05 * s.load},
                {"length", s.range() * random.uniform(0.15, 0.5)},
                {"u", random.uniform(0.0, 1.0) * s.range()}}}};
    case 1:
      return {{"bearing_tilt", {{"size", 0.1 * s.load / s.range()}, {"u", s.middle()}}}};
    case 2:
      return {{"maxwell_bush",
               {{"size", 0.1 * s.load / s.range()}, {"tau", random.log_uniform(0.03, 0.3)}}}};
    case 3:
      return {{"fading_oil",
               {{"size", 0.1 / (s.damping * s.speed)}, {"tau", random.log_uniform(0.5, 5.0)}}}};
    default: {
      const double omega = 2.0 * std::numbers::pi * random.uniform(5.0, 15.0);
      return {{"appendage", {{"size", 0.02}, {"omega", omega}, {"damping", 0.1 * omega}}}};
    }
  }
}

}  // namespace shaker::dirty
