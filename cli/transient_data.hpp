// Reads a record that is not periodic: a drop, a free decay, a sweep or random excitation.
#pragma once

#include <filesystem>

#include "base/result.hpp"
#include "estimator/fit/records/transient.hpp"

namespace shaker::cli {

// Columns t,excitation,displacement (the measured acceleration of the table, with its mean), or
// t,displacement, or t,y (no excitation: a free decay or a drop). t in s and increasing; at
// least 4 rows. An Error names file, line and column.
Result<estimator::TransientRecord> transient_from_csv(const std::filesystem::path& file,
                                                      const std::string& length_unit);

}  // namespace shaker::cli
