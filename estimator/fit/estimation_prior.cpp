// Normal priors (3.8) and the noise variance that gives them their weight.
//
// With noise variance s^2, -ln of the posterior is (SS(theta) + s^2 sum ((theta - m) / sigma)^2) /
// (2 s^2). A prior is therefore one more datum of weight s^2 / sigma^2. If s^2 is unknown, the
// present residuals give it. The objective is then (n - q) ln SS + the prior's sum, which has the
// same stationary points.
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/fit/estimation_impl.hpp"

namespace shaker::estimator {

double Estimator::Impl::noise_variance() const {
  if (covariances) return 1.0;
  if (options.noise > 0.0) return options.noise * options.noise;
  const double degrees = static_cast<double>(observations) - static_cast<double>(free.size());
  return degrees > 0.0 ? (sum_of_squares + total_scatter) / degrees
                       : std::numeric_limits<double>::quiet_NaN();
}

void Estimator::Impl::add_priors() {
  const double variance = noise_variance();
  if (!std::isfinite(variance)) return;
  const std::size_t q = free.size();
  for (std::size_t k = 0; k < q; ++k) {
    const ModelParameter& p = model.parameters()[static_cast<std::size_t>(free[k])];
    if (!p.prior_mean) continue;
    const double sigma = *p.prior_standard_deviation;
    const double weight = variance / (sigma * sigma);
    gram[k * q + k] += weight;
    gradient[k] += weight * (*p.prior_mean - fit.theta[static_cast<std::size_t>(free[k])]);
  }
}

double Estimator::Impl::prior_sum_at(const std::vector<double>& theta) const {
  double sum = 0.0;
  for (const int k : free) {
    const ModelParameter& p = model.parameters()[static_cast<std::size_t>(k)];
    if (!p.prior_mean) continue;
    const double off =
        (theta[static_cast<std::size_t>(k)] - *p.prior_mean) / *p.prior_standard_deviation;
    sum += off * off;
  }
  return sum;
}

double Estimator::Impl::objective() const {
  if (!priors) return sum_of_squares;
  if (covariances || options.noise > 0.0) return sum_of_squares + noise_variance() * prior_sum();
  const double degrees = static_cast<double>(observations) - static_cast<double>(free.size());
  return degrees * std::log(std::max(sum_of_squares + total_scatter, 1e-300)) + prior_sum();
}

}  // namespace shaker::estimator
