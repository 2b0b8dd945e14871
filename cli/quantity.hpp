// A number with its unit on the command line: "12kN", "18 lbf/ft^2", "350 mm".
#pragma once

#include <string>

#include "base/result.hpp"
#include "base/unit.hpp"

namespace shaker::cli {

// The value in the SI unit of `dimension`. `what`: the option or key, for messages. An Error says
// that the number or its unit is missing, or lists the known units.
Result<double> quantity(const std::string& what, const std::string& text, Dimension dimension);

}  // namespace shaker::cli
