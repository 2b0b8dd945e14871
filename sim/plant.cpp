#include "sim/plant.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/parts/gas_column.hpp"

namespace shaker::sim {
namespace {

using std::string_view;

#define SHAKER_HIDDEN_PARTS                                                         \
  "coulomb_friction", "presliding_friction", "viscous_damping", "linear_stiffness", \
      "cubic_stiffness", "end_stop", "bouc_wen_hysteresis", "added_mass"
constexpr string_view kOleo[] = {"orifice_damping",
                                 "gas_spring",
                                 "second_chamber",
                                 "real_gas",
                                 "gravity",
                                 "rebound_damping",
                                 "laminar_orifice",
                                 "metering_pin",
                                 "relief_valve",
                                 "oil_compressibility",
                                 "cavitation",
                                 "pressure_friction",
                                 SHAKER_HIDDEN_PARTS,
                                 "detent",
                                 "notch_damping",
                                 "leaning_bearing",
                                 "warming_oil",
                                 "leaking_gas",
                                 "tyre"};
constexpr string_view kLinear[] = {"linear_oscillator", "free_play", "detent", "leaning_bearing",
                                   SHAKER_HIDDEN_PARTS};
constexpr string_view kBoucWen[] = {"bouc_wen_oscillator", SHAKER_HIDDEN_PARTS};
#undef SHAKER_HIDDEN_PARTS

constexpr PlantEntry kPlants[] = {
    {"oleo", "landing-gear damper: orifice, gas spring, weight; hidden effects off", kOleo},
    {"linear", "linear oscillator u'' + theta1 u' + theta2 u = x", kLinear},
    {"bouc_wen", "Bouc-Wen oscillator with hysteretic restoring force", kBoucWen}};

const PlantEntry& find_plant(string_view name) {
  for (const auto& plant : kPlants) {
    if (plant.name == name) return plant;
  }
  std::vector<string_view> names;
  for (const auto& plant : kPlants) {
    names.push_back(plant.name);
  }
  throw std::invalid_argument(
      fmt::format("plant '{}' is unknown; choose one of {}", name, fmt::join(names, ", ")));
}

const PartEntry& find_part(string_view name) {
  for (const auto& part : part_table()) {
    if (part.name == name) return part;
  }
  throw std::logic_error(fmt::format("part '{}' is not in sim/parts/table.cpp", name));
}

Values complete(const PlantEntry& plant, const std::map<std::string, double>& given) {
  Values values;
  std::vector<string_view> names;
  for (const auto& parameter : parameters_of(plant)) {
    values.emplace(parameter.name, parameter.standard);
    names.push_back(parameter.name);
    const auto found = given.find(std::string(parameter.name));
    if (found == given.end()) continue;
    const double value = found->second;
    if (!(value >= parameter.lowest && value <= parameter.highest)) {
      throw std::invalid_argument(fmt::format("plant '{}': {} = {} {} is not in {} .. {}",
                                              plant.name, parameter.name, value, parameter.unit,
                                              parameter.lowest, parameter.highest));
    }
    values[found->first] = value;
  }
  for (const auto& [name, value] : given) {
    if (values.contains(name)) continue;
    throw std::invalid_argument(fmt::format("plant '{}' has no parameter '{}'; it has {}",
                                            plant.name, name, fmt::join(names, ", ")));
  }
  return values;
}

}  // namespace

int Memory::claim(double initial) {
  if (next_ >= kStates) throw std::logic_error("raise kStates in sim/plant_part.hpp");
  initial_[static_cast<std::size_t>(next_)] = initial;
  return next_++;
}

std::span<const PlantEntry> plant_table() {
  return kPlants;
}

std::vector<Parameter> parameters_of(const PlantEntry& plant) {
  std::vector<Parameter> all;
  for (const auto part : plant.parts) {
    const auto rows = find_part(part).parameters;
    all.insert(all.end(), rows.begin(), rows.end());
  }
  return all;
}

Plant::Plant(string_view name, const std::map<std::string, double>& given) {
  const PlantEntry& plant = find_plant(name);
  values_ = complete(plant, given);
  Memory memory;
  for (const auto part : plant.parts) {
    if (auto made = find_part(part).make(values_, memory)) parts_.push_back(std::move(made));
  }
  if (const auto compactness = values_.find("theta3"); compactness != values_.end()) {
    wall_ = (1.0 - kLeastGasColumn) / compactness->second;
  }
  if (values_.contains("tyre_stiffness") && values_.at("tyre_stiffness") > 0.0 &&
      (values_.at("coulomb_friction") > 0.0 || values_.at("pressure_friction") > 0.0)) {
    // The integrator decides from the table's motion alone whether the damper sticks.
    throw std::invalid_argument(
        "tyre_stiffness cannot be had together with coulomb_friction or pressure_friction; use "
        "presliding_friction instead");
  }
  at_rest_ = memory.initial();
  at_rest_[0] = find_rest(wall_.value_or(1.0));
}

// Bisection: the smooth forces grow with the stroke, and it runs only once for each plant.
double Plant::find_rest(double highest) const {
  State state = at_rest_;
  const auto force = [&](double u) {
    state[0] = u;
    return balance(state, 0.0).force;
  };
  double low = -1e-3;
  while (force(low) > 0.0) {
    low *= 2.0;
    if (low < -1e3) throw std::invalid_argument("the plant has no position of rest");
  }
  double high = highest;
  if (force(high) < 0.0) {
    throw std::invalid_argument("the gas spring does not carry the weight: raise theta2 or theta3");
  }
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (force(middle) < 0.0 ? low : high) = middle;
  }
  return std::abs(low) < std::abs(high) ? low : high;
}

Balance Plant::balance(const State& state, double direction) const {
  Balance sum;
  const Motion motion{state[0], state[1], direction, state};
  for (const auto& part : parts_) {
    part->add(motion, sum);
  }
  return sum;
}

State Plant::rate(const State& state, double direction, double x) const {
  State rate{};
  const Motion motion{state[0], state[1], direction, state};
  Balance sum;
  for (const auto& part : parts_) {
    part->add(motion, sum);
    part->remember(motion, rate);
  }
  const double force = sum.force + direction * sum.friction;
  double sinking = 0.0;
  for (const auto& part : parts_) {
    sinking += part->support(motion, force, x, rate);
  }
  if (direction != 0.0) {
    rate[0] = state[1];
    rate[1] = (x - force - sinking) / sum.mass;
  }
  return rate;
}

}  // namespace shaker::sim
