// The areas of a metering pin as JSON and as text.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "estimator/fit/pin_areas.hpp"

namespace shaker::cli {

nlohmann::ordered_json pin_areas_json(const std::vector<estimator::AreaAtKnot>& areas);
std::string pin_areas_text(const std::vector<estimator::AreaAtKnot>& areas,
                           const std::string& length);

}  // namespace shaker::cli
