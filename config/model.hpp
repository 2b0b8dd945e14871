/// \file
/// The model file: a sum of named effects, as data. Schema: config/schema/model.schema.json.
///
///   {"format": "shaker-model/1", "name": "oleo", "gravity": 9.80665,
///    "effects": [{"effect": "orifice_damping",
///                 "parameters": {"theta1": {"start": 16.0, "lower": 0}}}, ...]}
///
/// Omitted values (start, bounds, unit) come from the effect's own table in estimator/model/effects/.
/// A parameter may be fixed, or differ from run to run. estimator::make_model, which knows the
/// catalogue, detects unknown effects and parameters.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace shaker::config {

/// A run or a group in which a parameter has a value of its own.
struct RunValue {
  std::string label;            ///< name of the run, or of the group
  std::optional<double> start;  ///< empty: the parameter's own start
};

/// How a parameter differs from run to run. With `per` and `over` empty it is the same in all.
struct RunVariation {
  std::string per;   ///< "run" or "group": a value of its own for each
  std::string over;  ///< a condition of the runs, as "gas_temperature": in proportion to it; or
                     ///< "1/mass": in inverse proportion
  std::optional<double> reference;  ///< condition at which the parameter is stated; empty: the mean
  /// The values of `per`, in their order, once the runs are known. A model file does not have them.
  /// With them a Model has a parameter for each.
  std::vector<RunValue> values = {};
  /// \return true if the parameter is the same in all runs
  bool none() const { return per.empty() && over.empty(); }
  /// \return true if the parameter is in inverse proportion to the condition
  bool inverse() const { return over.starts_with("1/"); }
  /// \return the name of the condition; empty if there is none
  std::string condition() const { return inverse() ? over.substr(2) : over; }
};

/// A parameter as the model file gives it. Values are in the model's units.
struct ParameterSpec {
  /// Start and bounds. Empty: those of the effect's own table.
  /// @{
  std::optional<double> start, lower, upper;
  /// @}
  bool fixed = false;  ///< true: the fit leaves the parameter at its start
  /// Normal prior (3.8).
  /// @{
  std::optional<double> prior_mean, prior_standard_deviation;
  /// @}
  std::string unit;        ///< for a parameter of a formula; catalogue effects have their own
  RunVariation variation;  ///< from run to run
};

/// An internal state of a formula effect: z' = rate.
struct StateSpec {
  std::string rate;    ///< formula of the state's rate, a unit of the state per second
  double start = 0.0;  ///< at rest
};

/// Fewest and most knots of a table.
/// @{
inline constexpr std::size_t kFewestKnots = 4, kMostKnots = 12;
/// @}

/// A metering pin as a table: the area of the orifice over the stroke. Only ratios of areas count.
struct PinTable {
  std::vector<double> stroke;  ///< of each knot, increasing, in the model's length unit
  std::vector<double> area;    ///< at each knot, in any unit; empty: not known
  /// Standard deviation of ln(slope ratio) between neighbouring intervals about that of `area`,
  /// where the slope is that of ln(area).
  double smoothness = 1.0;
};

/// By what the size of a motion differs from that for which the catalogue's starts, bounds and
/// widths are meant. Forces are per unit mass.
struct MotionScale {
  /// Factors: measured size over the size for which the catalogue's numbers are meant.
  /// @{
  double length = 1.0, speed = 1.0, force = 1.0;
  /// @}
  double inertia = 1.0;  ///< the same of the masses that the forces may carry
  double reach = 0.0;    ///< the stroke farthest from 0; 0: not known
  /// \return true if all are equal
  bool operator==(const MotionScale&) const = default;
};

/// An effect that an input of the runs drives, as a coil's current: the effect of the catalogue, and
/// the input. Its name is "coulomb_friction over current".
struct Driven {
  std::string_view effect;  ///< name in the catalogue
  std::string_view input;   ///< empty: no input drives it
};
inline constexpr std::string_view kOver = " over ";  ///< between the two

/// \param name name of an effect
/// \return its parts
inline Driven driven(std::string_view name) {
  const auto at = name.find(kOver);
  if (at == name.npos) return {name, {}};
  return {name.substr(0, at), name.substr(at + kOver.size())};
}

/// \param effect name in the catalogue
/// \param input of the runs; may be empty
/// \return the name of the effect that the input drives
inline std::string driven_name(std::string_view effect, std::string_view input) {
  std::string name(effect);
  if (!input.empty()) name.append(kOver).append(input);
  return name;
}

/// One effect of a model file.
struct EffectSpec {
  std::string effect;  ///< name in the catalogue, and the input that drives it (driven_name)
  /// Of a driven effect: the input at which its coefficients are stated. Empty: the mean of the runs.
  std::optional<double> reference;
  std::map<std::string, ParameterSpec> parameters;  ///< by symbol
  std::map<std::string, double> constants;          ///< constants, e.g. a smoothing width
  /// For models of several coordinates (both empty for one): the combination of coordinates that
  /// the effect depends on, and the equations that contain its force; one number for each
  /// coordinate.
  /// @{
  std::vector<double> sees, acts;
  /// @}
  /// Of an effect that the model file defines (estimator/model/formula/): its force as a formula of u, v,
  /// a, x, states, parameters and constants. Empty: the effect is one of the catalogue.
  std::string formula;
  std::map<std::string, StateSpec> states;  ///< internal states, by symbol
  std::map<std::string, std::string>
      borrows;                    ///< for each borrowed symbol the effect that has the parameter
  std::optional<PinTable> table;  ///< of tabulated_pin
  MotionScale scale;  ///< of the starts, bounds and widths that are not given above; not in a file
  /// Of series_compliance: the joint is a part of the load path, as along an imposed motion, and not of
  /// the measured stroke alone.
  bool in_series = false;
};

/// The content of a model file.
struct ModelSpec {
  std::string name;                 ///< of the model
  double gravity = 9.80665;         ///< in the model's own length unit per s^2
  std::string length_unit = "m";    ///< a known unit, or a label that only this model uses
  std::vector<EffectSpec> effects;  ///< the terms of the sum, in the file's order
  /// For several coordinates: their names. Empty: one coordinate "stroke", mass 1, excitation 1.
  std::vector<std::string> coordinates;
  /// The mass matrix over the reference mass (s x s for s coordinates, row by row), and the factor
  /// of the excitation in each of the s equations.
  /// @{
  std::vector<double> mass, excitation;
  /// @}
  std::string observed;  ///< name of the coordinate that the displacement sensor measures
  std::string origin;    ///< file, for messages
};

/// Reads a model file. It checks the form; estimator::Model checks effects and parameters.
/// \param file path of the JSON file
/// \return the model; error `io`: the file cannot be read; `invalid`: the place and the remedy
Result<ModelSpec> load_model(const std::filesystem::path& file);
/// Reads a model from a text.
/// \param text content of a model file, JSON
/// \param origin name of the text in messages, for example its file
/// \return the model; error `invalid`: the place and the remedy
Result<ModelSpec> parse_model(const std::string& text, const std::string& origin);
/// Writes a model as a model file.
/// \param model any model
/// \return the JSON text, from which parse_model makes the same model
std::string to_json_text(const ModelSpec& model);

}  // namespace shaker::config
