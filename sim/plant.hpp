// The damper under test: a named list of parts with the true values of their parameters.
//
// Own physics: nothing here comes from the estimator, for a simulator that shared its code would
// prove nothing. Immutable after construction; the state belongs to the integrator.
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
  std::span<const std::string_view> parts;  // in order: gas before what rubs on it
};
std::span<const PlantEntry> plant_table();

class Plant {
 public:
  // Throws std::invalid_argument naming the unknown plant or parameter, or the value and its range.
  // `given` overrides defaults.
  Plant(std::string_view name, const std::map<std::string, double>& given);

  const Values& values() const { return values_; }

  // At rest where the forces balance without excitation.
  const State& at_rest() const { return at_rest_; }

  Balance balance(const State& state, double direction) const;
  // d state/dt under the table's acceleration x. direction 0: stuck, u and v stay.
  State rate(const State& state, double direction, double x) const;

  // Stroke at which the gas column is gone to a two-hundredth, where the formulas stop being
  // physics: metal meets metal. None for plants without gas.
  std::optional<double> wall() const { return wall_; }

 private:
  double find_rest(double highest) const;

  Values values_;
  std::vector<std::unique_ptr<PlantPart>> parts_;
  State at_rest_{};
  std::optional<double> wall_;
};

// The parameters that a plant takes, base parts first.
std::vector<Parameter> parameters_of(const PlantEntry& plant);

}  // namespace shaker::sim
