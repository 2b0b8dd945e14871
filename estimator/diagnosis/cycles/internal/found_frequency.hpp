// The frequency of a run from its samples.
#pragma once

#include <optional>
#include <vector>

namespace shaker::estimator::diagnosis {

// Returns the frequency of the strongest line of the spectrum, in Hz, to a hundredth of 1 / length
// of the record. Empty if there is no line: fewer than three cycles, or too few samples.
std::optional<double> found_frequency(const std::vector<double>& t, const std::vector<double>& y);

}  // namespace shaker::estimator::diagnosis
