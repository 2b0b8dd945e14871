// An estimate as text for people: a table of the parameters, the figures of the fit, the
// warnings. Pure.
#pragma once

#include <string>

#include "protocol/documents.hpp"

namespace shaker::report {

// The columns are parameter, value ± standard error, 95 % interval, unit and note. Below follow
// noise, condition, counts and usability, then each warning. Ends with a line break.
std::string estimate_table(const protocol::EstimateDocument& estimate);

// Whether values and intervals may be used; "usable" where both may.
std::string estimate_verdict(const protocol::EstimateDocument& estimate);

// One line: "theta1 16.67 ± 0.02, theta2 ...".
std::string estimate_line(const protocol::EstimateDocument& estimate);

}  // namespace shaker::report
