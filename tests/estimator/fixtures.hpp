// Models and data for several tests of the estimator.
#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "config/model.hpp"

namespace shaker::estimator::testing {

inline config::EffectSpec effect(const std::string& name) {
  config::EffectSpec spec;
  spec.effect = name;
  return spec;
}

inline config::ModelSpec model_of(std::vector<config::EffectSpec> effects,
                                  double gravity = 9.80665) {
  config::ModelSpec spec;
  spec.name = "test";
  spec.gravity = gravity;
  spec.effects = std::move(effects);
  return spec;
}

inline config::ModelSpec oleo(double gravity = 9.80665) {
  return model_of({effect("orifice_damping"), effect("gas_spring"), effect("gravity")}, gravity);
}

inline config::ModelSpec linear_oscillator() {
  return model_of({effect("viscous_damping"), effect("linear_stiffness")});
}

// Parameters: c, k, k3.
inline config::ModelSpec duffing() {
  return model_of(
      {effect("viscous_damping"), effect("linear_stiffness"), effect("cubic_stiffness")});
}

// The sprung mass on the oleo on the tyre. The coordinates are oleo stroke and tyre deflection,
// both relative; the unsprung mass is `ratio` times the sprung mass.
inline config::ModelSpec oleo_on_tyre(double ratio) {
  config::ModelSpec spec = oleo();
  spec.coordinates = {"stroke", "tyre"};
  spec.mass = {1.0, 1.0, 0.0, ratio};
  spec.excitation = {1.0, ratio};
  for (auto& e : spec.effects) {
    e.sees = {1.0, 0.0};
    e.acts = {1.0, e.effect == "gravity" ? ratio : -1.0};
  }
  auto spring = effect("linear_stiffness");
  auto damper = effect("viscous_damping");
  spring.sees = damper.sees = {0.0, 1.0};
  spring.acts = damper.acts = {0.0, 1.0};
  spec.effects.push_back(spring);
  spec.effects.push_back(damper);
  spec.observed = "stroke";
  return spec;
}

// True parameters of the paper's oleo, in SI units and in feet.
inline const std::vector<double> kOleoSi = {5.08 / 0.3048, 5.0 * 0.3048, 1.62 / 0.3048, 1.0};
inline const std::vector<double> kOleoFeet = {5.08, 5.0, 1.62, 1.0};

// All numbers of a comma-separated file, row by row, without the header.
inline std::vector<std::vector<double>> read_csv(const std::string& name, bool header = true) {
  std::ifstream file(std::filesystem::path(SHAKER_TEST_DATA) / name);
  if (!file) throw std::runtime_error("missing test data " + name);
  std::vector<std::vector<double>> rows;
  std::string line;
  if (header) std::getline(file, line);
  while (std::getline(file, line)) {
    std::vector<double> row;
    std::stringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) {
      try {
        row.push_back(std::stod(cell));
      } catch (const std::invalid_argument&) {  // the row's name
      }
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace shaker::estimator::testing
