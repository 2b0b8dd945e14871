// All runs of a campaign as steady cycles.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/diagnosis/cycles/steady_cycles.hpp"

namespace shaker::estimator::diagnosis {

// Drifts of the sensor's zero that are taken out, per second, by the run's name.
using Drifts = std::map<std::string, double>;

// Runs that can be used; what is wrong with the others is a warning. An Error when a record is
// mistaken, or no run can be fitted.
Result<std::vector<SteadyRun>> cut_campaign(const Campaign& campaign, const Drifts& drifts,
                                            std::vector<std::string>& warnings);

}  // namespace shaker::estimator::diagnosis
