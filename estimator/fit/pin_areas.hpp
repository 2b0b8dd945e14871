/// \file
/// The table of a metering pin as an estimate finds it: the area of the orifice at each knot.
#pragma once

#include <vector>

#include "config/model.hpp"
#include "estimator/fit/estimate.hpp"

namespace shaker::estimator {

/// In the unit of the model file's areas, the first as stated; without areas: over the first.
struct AreaAtKnot {
  double stroke = 0.0;  ///< of the knot, model's length unit
  double area = 0.0;    ///< the estimate
  /// Its 95 % interval; NaN where the data leave it open.
  /// @{
  double lower = 0.0, upper = 0.0;
  /// @}
};

/// Pure.
/// \param model the model file
/// \param estimate of that model
/// \return one for each knot; empty for a model without a table
std::vector<AreaAtKnot> pin_areas(const config::ModelSpec& model, const Estimate& estimate);

}  // namespace shaker::estimator
