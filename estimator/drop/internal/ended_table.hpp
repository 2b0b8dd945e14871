// A metering pin's table beyond its knots.
#pragma once

#include <optional>

#include "estimator/model/identified_damper.hpp"

namespace shaker::estimator {

// The damper whose table ends at its knots: the area stays there, where the table itself goes on with
// its last taper. Nothing for a damper without a table, for a table that covers the strokes from
// `low` to `high`, and for one with as many knots as a table may have.
std::optional<DamperHypothesis> ended_table(const DamperHypothesis& damper, double low,
                                            double high);

}  // namespace shaker::estimator
