// The units of columns, as campaign.json or the header row of a CSV file states them, and the
// factors that convert their numbers to the model's units.
#pragma once

#include <optional>
#include <string>

#include "base/result.hpp"
#include "cli/csv.hpp"
#include "config/object_reader.hpp"

namespace shaker::cli {

// The units in which a model counts: s, its unit of length, and forces over a mass.
struct ModelUnits {
  std::string length = "m";  // may be one that only this model uses
  double mass = 0.0;         // kg, of a force that is given in N; 0: such a force is refused

  // Model's number / file's number. `channel`: "t", "displacement", "y", "excitation",
  // "acceleration" or "force". The Error is a sentence without a place; it lists the known units.
  Result<double> factor(const std::string& channel, const std::string& unit) const;
};

// Model's number / file's number for each channel; empty where campaign.json states no unit.
struct Factors {
  std::optional<double> time, displacement, excitation, acceleration, force;
};

// Reads "units" of `document`. Adds a finding with its remedy for each unit that does not match.
Factors read_units(config::ObjectReader& document, config::Findings& findings,
                   const ModelUnits& model);

// The factor of a column by its header row, else `stated`, else 1. `column`: its name in the
// file. An Error where the unit of the header row is not known, or contradicts `stated`.
Result<double> column_factor(const CsvTable& table, const std::string& origin,
                             const std::string& column, const std::string& channel,
                             const ModelUnits& model, std::optional<double> stated);

// Converts every column whose header states a unit, such as "displacement [mm]". The columns
// have the names of their channels.
Result<void> to_model_units(CsvTable& table, const std::string& origin, const ModelUnits& model);

}  // namespace shaker::cli
