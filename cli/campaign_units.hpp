// The units of a campaign folder as campaign.json declares them, and the factors that convert
// its numbers to the model's units.
#pragma once

#include <string>

#include "config/object_reader.hpp"

namespace shaker::cli {

// Model's number / file's number for each column.
struct Factors {
  double time = 1.0, displacement = 1.0, excitation = 1.0, acceleration = 1.0, force = 1.0;
};

// Reads "units" and "reference_mass" (kg) of `document` for a model with lengths in
// `length_unit`. Adds a finding with its remedy for each unit that does not match.
Factors read_units(config::ObjectReader& document, config::Findings& findings,
                   const std::string& length_unit);

}  // namespace shaker::cli
