#include "estimator/diagnosis/fit/internal/places_of_rest.hpp"

#include <algorithm>
#include <cstddef>

#include "estimator/model/model_arrays.hpp"

namespace shaker::estimator::diagnosis {

bool rests_at_zero(const Model& model, const std::vector<double>& theta) {
  ModelArrays arrays;
  arrays.shape(model, 1);
  for (int k = model.mechanical(); k < model.coordinates(); ++k)
    arrays.u[static_cast<std::size_t>(k)][0] = model.rest(k);
  if (!arrays.evaluate(model, 1, theta.data())) return false;
  for (int k = 0; k < model.mechanical(); ++k)
    if (arrays.g[static_cast<std::size_t>(k)][0] != 0.0) return false;
  return true;
}

PlacesOfRest places_of_rest(bool own_zero, double low, double high) {
  PlacesOfRest places{std::min(low, 0.0), std::max(high, 0.0)};
  if (own_zero && low > 0.0) places.low = -high;
  if (own_zero && high < 0.0) places.high = -low;
  return places;
}

}  // namespace shaker::estimator::diagnosis
