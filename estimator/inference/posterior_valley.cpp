#include "estimator/inference/internal/posterior_valley.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "estimator/inference/internal/posterior_proposal.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kWider = 1.3;  // factor on the standard deviations at the nodes

}  // namespace

Valley::Valley(Index along, std::vector<ValleyNode> nodes)
    : along_(along), nodes_(std::move(nodes)), below_(1, 0.0) {
  double most = nodes_.front().log_mass;
  for (const ValleyNode& node : nodes_)
    most = std::max(most, node.log_mass);
  for (const ValleyNode& node : nodes_)
    height_.push_back(std::exp(node.log_mass - most));
  for (std::size_t i = 0; i + 1 < nodes_.size(); ++i)
    below_.push_back(below_.back() +
                     0.5 * (height_[i] + height_[i + 1]) * (nodes_[i + 1].at - nodes_[i].at));
  const double whole = below_.back();
  for (double& height : height_)
    height /= whole;
  for (double& below : below_)
    below /= whole;
}

Valley::Centre Valley::centre(std::size_t left, double share) const {
  const ValleyNode &a = nodes_[left], &b = nodes_[left + 1];
  return {a.others + share * (b.others - a.others), kWider * (a.root + share * (b.root - a.root))};
}

VectorXd Valley::draw(std::mt19937_64& random) const {
  const double wanted = std::uniform_real_distribution<double>(0.0, 1.0)(random);
  const auto after = std::upper_bound(below_.begin() + 1, below_.end() - 1, wanted);
  const auto left = static_cast<std::size_t>(after - below_.begin()) - 1;
  const double width = nodes_[left + 1].at - nodes_[left].at;
  const double rise = height_[left + 1] - height_[left];
  // Solves height * x + rise / (2 width) x^2 = the remaining probability of this segment.
  const double part = (wanted - below_[left]) / width;
  const double root = std::sqrt(std::max(0.0, height_[left] * height_[left] + 2.0 * rise * part));
  const double share = std::clamp(2.0 * part / std::max(height_[left] + root, 1e-300), 0.0, 1.0);
  const Centre here = centre(left, share);
  const VectorXd others = here.others + here.root * heavy_tailed(here.others.size(), random);
  VectorXd out(others.size() + 1);
  out.head(along_) = others.head(along_);
  out[along_] = nodes_[left].at + share * width;
  out.tail(others.size() - along_) = others.tail(others.size() - along_);
  return out;
}

double Valley::density(const VectorXd& at) const {
  const double where = at[along_];
  if (!(where >= nodes_.front().at && where < nodes_.back().at)) return 0.0;
  const auto after = std::upper_bound(nodes_.begin(), nodes_.end(), where,
                                      [](double x, const ValleyNode& node) { return x < node.at; });
  const auto left = static_cast<std::size_t>(after - nodes_.begin()) - 1;
  const double share = (where - nodes_[left].at) / (nodes_[left + 1].at - nodes_[left].at);
  const Centre here = centre(left, share);
  VectorXd others(here.others.size());
  others.head(along_) = at.head(along_);
  others.tail(others.size() - along_) = at.tail(others.size() - along_);
  return (height_[left] + share * (height_[left + 1] - height_[left])) *
         heavy_tailed_density(others, here.others, here.root);
}

std::vector<Index> likely_valleys(const MatrixXd& covariance) {
  const MatrixXd information = covariance.inverse();
  std::vector<Index> order(static_cast<std::size_t>(covariance.rows()));
  std::iota(order.begin(), order.end(), Index{0});
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) {
    return covariance(a, a) * information(a, a) > covariance(b, b) * information(b, b);
  });
  return order;
}

}  // namespace shaker::estimator
