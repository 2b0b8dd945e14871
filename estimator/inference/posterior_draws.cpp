#include "estimator/inference/internal/posterior_draws.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double weighted_quantile(const std::vector<double>& value, const std::vector<double>& weight,
                         const std::vector<std::size_t>& order, double probability) {
  double below = 0.0, previous = value[order.front()];
  for (std::size_t i = 0; i < order.size(); ++i) {
    const double w = weight[order[i]];
    const double middle = below + 0.5 * w;
    if (middle >= probability) {
      const double before = i > 0 ? below - 0.5 * weight[order[i - 1]] : 0.0;
      const double share = middle > before ? (probability - before) / (middle - before) : 1.0;
      return previous + std::clamp(share, 0.0, 1.0) * (value[order[i]] - previous);
    }
    below += w;
    previous = value[order[i]];
  }
  return previous;
}

}  // namespace

void weigh(Draws& draws) {
  const double sum = std::accumulate(draws.weight.begin(), draws.weight.end(), 0.0);
  double squares = 0.0;
  draws.mean = VectorXd::Zero(draws.theta.front().size());
  for (std::size_t i = 0; i < draws.theta.size(); ++i) {
    draws.weight[i] /= sum;
    squares += draws.weight[i] * draws.weight[i];
    draws.mean += draws.weight[i] * draws.theta[i];
  }
  draws.effective = 1.0 / squares;
  draws.covariance = MatrixXd::Zero(draws.mean.size(), draws.mean.size());
  for (std::size_t i = 0; i < draws.theta.size(); ++i) {
    const VectorXd off = draws.theta[i] - draws.mean;
    draws.covariance += draws.weight[i] * off * off.transpose();
  }
}

std::vector<VectorXd> even_choice(const Draws& draws, std::size_t count) {
  std::vector<VectorXd> chosen;
  double sum = 0.0;
  for (std::size_t i = 0; i < draws.theta.size(); ++i) {
    sum += draws.weight[i];
    while (chosen.size() < count &&
           sum > (static_cast<double>(chosen.size()) + 0.5) / static_cast<double>(count))
      chosen.push_back(draws.theta[i]);
  }
  return chosen;
}

double effective_for_mean(const Draws& draws, Index k) {
  double error = 0.0;
  for (std::size_t i = 0; i < draws.theta.size(); ++i) {
    const double part = draws.weight[i] * (draws.theta[i][k] - draws.mean[k]);
    error += part * part;
  }
  return error > 0.0 ? draws.covariance(k, k) / error : 0.0;
}

PosteriorMarginal marginal(const Draws& draws, Index k, double mode, double confidence) {
  std::vector<double> value;
  for (const VectorXd& theta : draws.theta)
    value.push_back(theta[k]);
  std::vector<std::size_t> order(value.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return value[a] != value[b] ? value[a] < value[b] : a < b;
  });
  PosteriorMarginal out;
  out.mean = draws.mean[k];
  out.mode = mode;
  out.standard_deviation = std::sqrt(draws.covariance(k, k));
  out.effective_samples = effective_for_mean(draws, k);
  const double tail = 0.5 * (1.0 - confidence);
  out.median = weighted_quantile(value, draws.weight, order, 0.5);
  out.lower = weighted_quantile(value, draws.weight, order, tail);
  out.upper = weighted_quantile(value, draws.weight, order, 1.0 - tail);
  return out;
}

}  // namespace shaker::estimator
