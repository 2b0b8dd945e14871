#include "estimator/drop/internal/force_slopes.hpp"

#include <algorithm>

#include "estimator/model/model_arrays.hpp"

namespace shaker::estimator {

std::optional<Eigen::MatrixXd> force_slopes(const DamperHypothesis& damper,
                                            const std::vector<VisitedCell>& points) {
  const Model model(damper.model);
  if (model.mechanical() != 1) return std::nullopt;
  const auto count = static_cast<int>(points.size());
  ModelArrays arrays;
  arrays.shape(model, count);
  for (int i = 0; i < count; ++i) {
    arrays.u[0][i] = points[static_cast<std::size_t>(i)].stroke;
    arrays.v[0][i] = points[static_cast<std::size_t>(i)].velocity;
    for (int k = 1; k < model.coordinates(); ++k)
      arrays.u[static_cast<std::size_t>(k)][i] = model.rest(k);
  }
  if (!arrays.evaluate(model, count, model.start().data())) return std::nullopt;
  const auto places = numbers_of(model);
  Eigen::MatrixXd slopes =
      Eigen::MatrixXd::Zero(count, static_cast<Eigen::Index>(damper.numbers.size()));
  for (std::size_t k = 0; k < damper.numbers.size(); ++k) {
    const ModelNumber& number = damper.numbers[k];
    const auto at = std::find_if(places.begin(), places.end(), [&](const ModelNumber& p) {
      return !number.constant && p.line == number.line && p.symbol == number.symbol;
    });
    if (at == places.end()) continue;
    const double* slope = arrays.g_theta[static_cast<std::size_t>(at - places.begin())];
    slopes.col(static_cast<Eigen::Index>(k)) = Eigen::Map<const Eigen::VectorXd>(slope, count);
  }
  if (!slopes.allFinite()) return std::nullopt;
  return slopes;
}

}  // namespace shaker::estimator
