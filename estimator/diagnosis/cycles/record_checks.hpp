// What every record must be, periodic or not: columns of one length, finite, over a time that goes
// on. Errors are sentences that name the run.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/diagnosis/campaign.hpp"

namespace shaker::estimator::diagnosis {

// A mistake in what was given.
Error mistake_in(const Recording& run, const std::string& why);
// Not a mistake: the run as it went cannot be used.
Error unfit(const Recording& run, const std::string& why);

// Finite and increasing.
Result<void> check_times(const Recording& run);
// As long as the times, and finite. `name`: of the channel, for the sentence.
Result<void> check_column(const Recording& run, const std::vector<double>& column,
                          const char* name);
// Part of what is said of a run whose response slips against its driver.
inline constexpr const char* kTwoClocks = "the channels are not on one clock";
// What is said of a channel at the end of its range.
std::string clipped_sentence(const char* name, bool top);

// Highest less lowest.
double range_of(const std::vector<double>& column);

}  // namespace shaker::estimator::diagnosis
