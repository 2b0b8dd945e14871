// A stepped sweep: one entry of a campaign's runs that stands for a dwell at each of several
// frequencies or amplitudes.
#pragma once

#include <string>
#include <vector>

#include "config/object_reader.hpp"

namespace shaker::config {

// The values of the member `key` of `reader`: one of a number, several of an object
// {"from", "to", "steps", "spacing"}, in the order of the sweep. `range` holds for each of them.
// Adds a finding and returns none if the member is absent or wrong.
std::vector<double> read_steps(ObjectReader& reader, const std::string& key, Range range,
                               Findings& findings);

}  // namespace shaker::config
