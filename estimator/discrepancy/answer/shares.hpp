// How sure a name is: shares of the probability among everything that was refitted, nothing, and
// the unknown.
//
// Where the best leaves nothing but noise, the unknown has what the test of that leaves it;
// otherwise all evidence counts by as much less as the best leaves more than noise, and no name is
// surer than the share of the gap that it closes.
#pragma once

#include <string>
#include <vector>

#include "estimator/discrepancy/answer/selection.hpp"

namespace shaker::estimator::discrepancy {

// Of a name, while something is left.
inline constexpr double kMostUnexplained = 0.9;

// A share for each of `found.hypotheses`.
std::vector<double> shares(const Naming& found, const std::vector<RunDatum>& data,
                           const Selection& selection);

// The same, once what is chosen holds only effects that are worth a name: the improved model and
// the names agree.
std::vector<double> agreed_shares(const Naming& found, const std::vector<RunDatum>& data,
                                  Selection& selection);

// Of all hypotheses that hold the effect.
double probability_of(const std::string& effect, const Naming& found,
                      const std::vector<double>& shares);

}  // namespace shaker::estimator::discrepancy
