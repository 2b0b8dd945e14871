#include "estimator/inference/internal/posterior_weights.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace shaker::estimator {
namespace {

// Shape of the generalised Pareto distribution of `x` (excesses, ascending) by Zhang and Stephens
// (2009), with the weak prior towards 1/2 of Vehtari et al.; writes the scale to `sigma`.
double pareto_shape(const std::vector<double>& x, double& sigma) {
  const auto n = static_cast<double>(x.size());
  const int grid = 30 + static_cast<int>(std::sqrt(n));
  const double quarter = x[static_cast<std::size_t>(n / 4.0 + 0.5) - 1];
  std::vector<double> theta, likelihood;
  const auto shape_at = [&](double t) {
    double sum = 0.0;
    for (const double value : x)
      sum += std::log1p(-t * value);
    return sum / n;
  };
  for (int j = 1; j <= grid; ++j) {
    const double t = 1.0 / x.back() + (1.0 - std::sqrt(grid / (j - 0.5))) / (3.0 * quarter);
    const double k = shape_at(t);
    theta.push_back(t);
    likelihood.push_back(n * (std::log(-t / k) - k - 1.0));
  }
  double total = 0.0, mean = 0.0;
  for (std::size_t j = 0; j < theta.size(); ++j) {
    double share = 0.0;
    for (const double other : likelihood)
      share += std::exp(other - likelihood[j]);
    mean += theta[j] / share;
    total += 1.0 / share;
  }
  mean /= total;
  const double k = shape_at(mean);
  sigma = -k / mean;
  return (k * n + 0.5 * 10.0) / (n + 10.0);
}

}  // namespace

double smooth_weights(std::vector<double>& weight) {
  const auto count = static_cast<double>(weight.size());
  const auto tail = static_cast<std::size_t>(std::min(0.2 * count, 3.0 * std::sqrt(count)));
  if (tail < 10) return std::numeric_limits<double>::infinity();
  std::vector<std::size_t> order(weight.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return weight[a] != weight[b] ? weight[a] < weight[b] : a < b;
  });
  const std::size_t first = order.size() - tail;
  const double cut = weight[order[first - 1]], largest = weight[order.back()];
  // Equal weights: the proposal is the posterior.
  if (!(largest > cut * (1.0 + 1e-9))) return -std::numeric_limits<double>::infinity();
  std::vector<double> excess;
  for (std::size_t i = first; i < order.size(); ++i)
    excess.push_back(std::max(weight[order[i]] - cut, 1e-300));
  double sigma = 1.0;
  const double k = pareto_shape(excess, sigma);
  if (!std::isfinite(k) || !(sigma > 0.0)) return std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < tail; ++i) {
    const double p = (static_cast<double>(i) + 0.5) / static_cast<double>(tail);
    const double quantile = std::fabs(k) > 1e-12 ? sigma * std::expm1(-k * std::log1p(-p)) / k
                                                 : -sigma * std::log1p(-p);
    weight[order[first + i]] = std::min(cut + quantile, largest);
  }
  return k;
}

}  // namespace shaker::estimator
