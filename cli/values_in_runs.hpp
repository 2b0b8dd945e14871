// Estimates of parameters that are not the same in all runs, as JSON and as text.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "estimator/estimate.hpp"

namespace shaker::cli {

nlohmann::ordered_json in_runs_json(const std::vector<estimator::ValueInRun>& values);
std::string in_runs_table(
    const std::vector<estimator::ValueInRun>& values);  // empty where there are none

}  // namespace shaker::cli
