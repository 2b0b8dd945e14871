// Checks of every record: columns of one length, finite values, times that increase. Errors are
// sentences that name the run.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/diagnosis/campaign.hpp"

namespace shaker::estimator::diagnosis {

// An error in the input.
Error mistake_in(const Recording& run, const std::string& why);
// Not an error in the input: the run itself cannot be used.
Error unfit(const Recording& run, const std::string& why);

// Checks that times are finite and increase.
Result<void> check_times(const Recording& run);
// Checks that a column is as long as the times, and finite. `name`: of the channel, for the
// sentence.
Result<void> check_column(const Recording& run, const std::vector<double>& column,
                          const char* name);
// Part of the sentence for a run whose response slips against its driver.
inline constexpr const char* kTwoClocks = "the channels are not on one clock";
// Part of the sentence for a channel at the end of its range.
inline constexpr const char* kClipped = "the sensor is clipped";
// The sentence for such a channel.
std::string clipped_sentence(const char* name, bool top);

// Largest minus smallest value.
double range_of(const std::vector<double>& column);

}  // namespace shaker::estimator::diagnosis
