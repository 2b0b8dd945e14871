// The damper under test: a named list of parts and the true values of their parameters.
//
// The physics is independent: no code comes from the estimator, because a simulator that shared
// code with it would prove nothing. A plant is immutable after construction; the state belongs
// to the integrator.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sim/plant_part.hpp"

namespace shaker::sim {

struct PlantEntry {
  std::string_view name, meaning;
  std::span<const std::string_view> parts;  // in order: gas before what depends on it
};
std::span<const PlantEntry> plant_table();

class Plant {
 public:
  // `given` overrides defaults. Throws std::invalid_argument that names an unknown plant or
  // parameter, a value out of its range, or a plant that has no position of rest.
  Plant(std::string_view name, const std::map<std::string, double>& given);

  const Values& values() const { return values_; }

  // The state at rest, where the forces balance without excitation.
  const State& at_rest() const { return at_rest_; }

  // The sum of all parts' forces. direction: +1, -1, or 0 when the damper sticks.
  Balance balance(const State& state, double direction) const;
  // d state / dt under the table's acceleration x, m/s^2. With direction 0, u and v do not
  // change.
  State rate(const State& state, double direction, double x) const;

  // The stroke, m, at which kLeastGasColumn of the gas column is left; beyond it the formulas
  // are no longer physics, because metal meets metal. nullopt for plants without gas.
  std::optional<double> wall() const { return wall_; }

 private:
  double find_rest(double highest) const;

  Values values_;
  std::vector<std::unique_ptr<PlantPart>> parts_;
  State at_rest_{};
  std::optional<double> wall_;
};

// The parameters of a plant, in the order of its parts.
std::vector<Parameter> parameters_of(const PlantEntry& plant);

}  // namespace shaker::sim
