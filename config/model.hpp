// The model file: a sum of named effects, as data. Schema: config/schema/model.schema.json.
//
//   {"format": "shaker-model/1", "name": "oleo", "gravity": 9.80665,
//    "effects": [{"effect": "orifice_damping",
//                 "parameters": {"theta1": {"start": 16.0, "lower": 0}}}, ...]}
//
// Omitted values (start, bounds, unit) come from the effect's own table in estimator/effects/.
// A parameter may be fixed. estimator::make_model, which knows the catalogue, detects unknown
// effects and parameters.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace shaker::config {

struct ParameterSpec {
  std::optional<double> start, lower, upper;
  bool fixed = false;
  std::optional<double> prior_mean, prior_standard_deviation;  // normal prior (3.8)
  std::string unit;  // for a parameter of a formula; catalogue effects have their own
};

// An internal state of a formula effect: z' = rate.
struct StateSpec {
  std::string rate;
  double start = 0.0;  // at rest
};

// By what the size of a motion differs from that for which the catalogue's starts, bounds and widths
// are meant. Forces are per unit mass.
struct MotionScale {
  double length = 1.0, speed = 1.0, force = 1.0;
  bool operator==(const MotionScale&) const = default;
};

struct EffectSpec {
  std::string effect;                               // name in the catalogue
  std::map<std::string, ParameterSpec> parameters;  // by symbol
  std::map<std::string, double> constants;          // constants, e.g. a smoothing width
  // For models of several coordinates (both empty for one): the combination of coordinates that
  // the effect depends on, and the equations that contain its force; one number for each
  // coordinate.
  std::vector<double> sees, acts;
  // An effect that the model file defines (estimator/formula/): its force as a formula of u, v,
  // a, x, states, parameters and constants, and the effects whose parameters it uses, by
  // symbol.
  std::string formula;
  std::map<std::string, StateSpec> states;
  std::map<std::string, std::string> borrows;
  MotionScale scale;  // of the starts, bounds and widths that are not given above; not in a file
};

struct ModelSpec {
  std::string name;
  double gravity = 9.80665;       // in the model's own length unit per s^2
  std::string length_unit = "m";  // a known unit, or a label that only this model uses
  std::vector<EffectSpec> effects;
  // For several coordinates: their names, the mass matrix over the reference mass (row by row),
  // the factor of the excitation in each equation, and the coordinate that the displacement
  // sensor measures. Empty: one coordinate "stroke", mass 1, excitation 1.
  std::vector<std::string> coordinates;
  std::vector<double> mass, excitation;
  std::string observed;
  std::string origin;  // file, for messages
};

Result<ModelSpec> load_model(const std::filesystem::path& file);
Result<ModelSpec> parse_model(const std::string& text, const std::string& origin);
std::string to_json_text(const ModelSpec& model);  // round-trips through parse_model

}  // namespace shaker::config
