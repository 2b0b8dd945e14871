#include "estimator/fit/pin_areas.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/model/effects/tabulated_pin.hpp"

namespace shaker::estimator {
namespace {

// fall, r2.. of the estimate: values, and places in its covariance (-1: fixed).
struct PinParameters {
  std::vector<double> theta;
  std::vector<std::ptrdiff_t> places;
  double quantile = 0.0;  // of the intervals, in standard errors
};

PinParameters parameters_of_pin(const Estimate& estimate) {
  PinParameters pin;
  const auto& order = estimate.covariance_order;
  for (const ParameterEstimate& p : estimate.parameters) {
    if (p.effect != "tabulated_pin") continue;
    pin.theta.push_back(p.value);
    const auto at = std::find(order.begin(), order.end(), p.name);
    pin.places.push_back(at == order.end() ? -1 : at - order.begin());
    if (p.standard_error > 0.0)
      pin.quantile = std::max(pin.quantile, (p.upper - p.value) / p.standard_error);
  }
  return pin;
}

// Standard error of ln(area).
double error_of(const PinArea& area, const PinParameters& pin, const Estimate& estimate) {
  const std::size_t size = estimate.covariance_order.size();
  if (estimate.covariance.size() != size * size) return std::numeric_limits<double>::quiet_NaN();
  double variance = 0.0;
  for (std::size_t i = 0; i < pin.places.size(); ++i) {
    for (std::size_t k = 0; k < pin.places.size(); ++k) {
      if (pin.places[i] < 0 || pin.places[k] < 0) continue;
      const auto at =
          static_cast<std::size_t>(pin.places[i]) * size + static_cast<std::size_t>(pin.places[k]);
      variance += area.slopes[i] * estimate.covariance[at] * area.slopes[k];
    }
  }
  return std::sqrt(std::max(0.0, variance)) / area.ratio;
}

}  // namespace

std::vector<AreaAtKnot> pin_areas(const config::ModelSpec& model, const Estimate& estimate) {
  std::vector<AreaAtKnot> areas;
  const auto line = std::find_if(model.effects.begin(), model.effects.end(),
                                 [](const auto& effect) { return effect.table.has_value(); });
  if (line == model.effects.end()) return areas;
  const config::PinTable& table = *line->table;
  const PinParameters pin = parameters_of_pin(estimate);
  if (pin.theta.size() + 1 != table.stroke.size()) return areas;
  const double first = table.area.empty() ? 1.0 : table.area.front();
  for (const double stroke : table.stroke) {
    const auto found = pin_area(table, pin.theta.data(), stroke);
    const double area = first * found.ratio;
    const double half = pin.quantile * error_of(found, pin, estimate);
    areas.push_back({stroke, area, area * std::exp(-half), area * std::exp(half)});
  }
  return areas;
}

}  // namespace shaker::estimator
