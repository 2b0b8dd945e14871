// The units of a campaign's folder, as campaign.json says them, and what turns its numbers into the
// model's.
#pragma once

#include <string>

#include "config/object_reader.hpp"

namespace shaker::cli {

struct Factors {
  double time = 1.0, displacement = 1.0, excitation = 1.0, acceleration = 1.0, force = 1.0;
};

// Reads "units" and "reference_mass" of `document`, for a model that counts in `length_unit`. What
// does not match is among the findings, with its remedy.
Factors read_units(config::ObjectReader& document, config::Findings& findings,
                   const std::string& length_unit);

}  // namespace shaker::cli
