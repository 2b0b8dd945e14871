// The frequency of a run, from its samples alone.
#pragma once

#include <optional>
#include <vector>

namespace shaker::estimator::diagnosis {

// Hz, of the strongest line in the spectrum, to a hundredth of one over the record's length. Nothing
// where there is no line: fewer than three cycles, or samples too few for one.
std::optional<double> found_frequency(const std::vector<double>& t, const std::vector<double>& y);

}  // namespace shaker::estimator::diagnosis
