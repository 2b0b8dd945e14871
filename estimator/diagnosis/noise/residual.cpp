#include "estimator/diagnosis/noise/internal/residual.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/noise/internal/noise_floor.hpp"

namespace shaker::estimator::diagnosis {

using Eigen::VectorXd;

std::vector<VectorXd> fit_residuals(const Fitted& fitted, const std::vector<RunDatum>& given,
                                    std::size_t shown) {
  const double clock = clock_error(fitted.fit, fitted.data);
  std::vector<VectorXd> all;
  for (std::size_t r = 0; r < shown; ++r) {
    const RunDatum& datum = fitted.data[r];
    VectorXd left = datum.response - fitted.fit.predictions[r].value();
    if (datum.clock.size() > 0) left -= clock * datum.clock;
    if (&fitted.data != &given) left = covariance_of(given[r]) * over_covariance(datum, left);
    all.push_back(without_own_zero(datum, std::move(left)));
  }
  return all;
}

double mean_square(const std::vector<VectorXd>& left) {
  double sum = 0.0;
  for (const VectorXd& l : left)
    sum += std::pow(root_mean_square(l), 2) / static_cast<double>(left.size());
  return std::sqrt(sum);
}

double gap_over_floor(const Fitted& fitted, const std::vector<RunDatum>& given) {
  // Further channels stand behind the runs.
  const auto shown =
      static_cast<std::size_t>(std::count_if(given.begin(), given.end(), [](const RunDatum& datum) {
        return datum.quantity == Quantity::displacement;
      }));
  const auto left = fit_residuals(fitted, given, shown);
  std::vector<VectorXd> of_fitted;
  for (std::size_t r = 0; r < shown; ++r) {
    if (given[r].role == Role::fit) of_fitted.push_back(left[r]);
  }
  return mean_square(of_fitted) / noise_floor(fitted.fit, given, shown).whole.floor;
}

}  // namespace shaker::estimator::diagnosis
