// The table of a metering pin as an estimate finds it: the area of the orifice at each knot.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "config/model.hpp"
#include "estimator/estimate.hpp"

namespace shaker::cli {

// In the unit of the model file's areas, the first as stated; without areas: over the first.
struct AreaAtKnot {
  double stroke = 0.0, area = 0.0;
  double lower = 0.0, upper = 0.0;  // 95 %; NaN where the data leave it open
};

// Empty for a model without a table.
std::vector<AreaAtKnot> pin_areas(const config::ModelSpec& model,
                                  const estimator::Estimate& estimate);

nlohmann::ordered_json pin_areas_json(const std::vector<AreaAtKnot>& areas);
std::string pin_areas_text(const std::vector<AreaAtKnot>& areas, const std::string& length);

}  // namespace shaker::cli
