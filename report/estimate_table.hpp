// An estimate for people: a table of the parameters, the fit's figures, the warnings. Pure.
#pragma once

#include <string>

#include "protocol/documents.hpp"

namespace shaker::report {

// parameter, value ± standard error, 95 % interval, unit, note; then noise, condition, counts and
// whether it is usable; then each warning. Ends with a line break.
std::string estimate_table(const protocol::EstimateDocument& estimate);

// One line: "theta1 16.67 ± 0.02, theta2 ...".
std::string estimate_line(const protocol::EstimateDocument& estimate);

}  // namespace shaker::report
