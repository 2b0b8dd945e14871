// Traces a valley: trace_valley of posterior_valley.hpp.
#include <algorithm>
#include <cmath>

#include "estimator/inference/internal/posterior_likelihood.hpp"
#include "estimator/inference/internal/posterior_valley.hpp"
#include "estimator/math/dense.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kDifference = 0.25;  // of finite differences, in standard deviations of the others
constexpr double kFound = 0.05;       // convergence: last Newton step, in the same unit
constexpr double kLongest = 2.0;      // largest Newton step, in the same unit
constexpr int kMostIterations = 15;
constexpr double kFirstStep = 0.1;      // along the valley, in marginal standard deviations
constexpr double kSmallestStep = 1e-4;  // in the same unit
constexpr double kLargestStep = 5.0;
constexpr double kMostBend = 1.0;         // of the others from linear, in standard deviations
constexpr double kMostFall = 1.0;         // change of log mass over a step
constexpr double kMaxLogMassDrop = 16.0;  // log mass below the largest at which the walk ends
constexpr int kMostNodes = 500;           // on each side

class ValleyWalk {
 public:
  ValleyWalk(LogDensity& density, const VectorXd& mode, const MatrixXd& covariance, Index along)
      : density_(density), size_(mode.size()), along_(along), theta_(mode) {
    const MatrixXd rest = inverse_of(covariance);
    MatrixXd information(size_ - 1, size_ - 1);
    for (Index k = 0; k + 1 < size_; ++k) {
      for (Index l = 0; l + 1 < size_; ++l)
        information(k, l) = rest(k + (k >= along_), l + (l >= along_));
    }
    start_.at = mode[along_];
    start_.others = without(mode);
    start_.root = Cholesky(inverse_of(information)).root();
  }

  const ValleyNode& start() const { return start_; }

  // Finds the others' best values and scatter at node.at, starting from the values in `node`.
  // False if there are none; `outside` is true if the density is zero at the start.
  bool settle(ValleyNode& node, bool& outside) {
    outside = !(log_at(node, VectorXd::Zero(size_ - 1)) > kNowhere);
    if (outside) return false;
    for (int i = 0; i < kMostIterations; ++i) {
      if (!look_around(node)) return false;
      const Cholesky bend(-curvature_);
      const bool peaked = bend.positive();
      VectorXd step = peaked ? bend.solve(slope_) : slope_;
      const double length = step.norm();
      if (length > kLongest) step *= kLongest / length;
      if (!uphill(node, step)) return false;
      if (!peaked) continue;
      node.root = Cholesky(node.root * bend.solve(MatrixXd(node.root.transpose()))).root();
      if (length > kFound) continue;
      node.log_mass =
          log_at(node, VectorXd::Zero(size_ - 1)) + node.root.diagonal().array().log().sum();
      return std::isfinite(node.log_mass);
    }
    return false;
  }

 private:
  VectorXd without(const VectorXd& all) const {
    VectorXd out(size_ - 1);
    out.head(along_) = all.head(along_);
    out.tail(size_ - 1 - along_) = all.tail(size_ - 1 - along_);
    return out;
  }

  double log_at(const ValleyNode& node, const VectorXd& z) {
    const VectorXd others = node.others + node.root * z;
    theta_.head(along_) = others.head(along_);
    theta_[along_] = node.at;
    theta_.tail(size_ - 1 - along_) = others.tail(size_ - 1 - along_);
    return density_({theta_.data(), static_cast<std::size_t>(size_)});
  }

  // Gradient and Hessian of the log density over the others, in units of node.root. False where
  // they are not finite.
  bool look_around(const ValleyNode& node) {
    const Index d = size_ - 1;
    VectorXd z = VectorXd::Zero(d), up(d), down(d);
    const double here = log_at(node, z);
    slope_.resize(d);
    curvature_.resize(d, d);
    for (Index k = 0; k < d; ++k) {
      z[k] = kDifference;
      up[k] = log_at(node, z);
      z[k] = -kDifference;
      down[k] = log_at(node, z);
      z[k] = 0.0;
      slope_[k] = (up[k] - down[k]) / (2.0 * kDifference);
      curvature_(k, k) = (up[k] - 2.0 * here + down[k]) / (kDifference * kDifference);
    }
    for (Index k = 0; k < d; ++k) {
      for (Index l = 0; l < k; ++l) {
        z[k] = z[l] = kDifference;
        const double both = log_at(node, z);
        z[k] = z[l] = -kDifference;
        const double neither = log_at(node, z);
        z[k] = z[l] = 0.0;
        curvature_(k, l) = curvature_(l, k) =
            (both + neither - up[k] - up[l] - down[k] - down[l] + 2.0 * here) /
            (2.0 * kDifference * kDifference);
      }
    }
    return slope_.allFinite() && curvature_.allFinite();
  }

  bool uphill(ValleyNode& node, VectorXd step) {
    const double here = log_at(node, VectorXd::Zero(size_ - 1));
    for (int half = 0; half < 6; ++half, step *= 0.5) {
      if (!(log_at(node, step) >= here - 1e-6)) continue;
      node.others += node.root * step;
      return true;
    }
    return step.norm() < kFound;
  }

  LogDensity& density_;
  Index size_, along_;
  VectorXd theta_, slope_;
  MatrixXd curvature_;
  ValleyNode start_;
};

// Distance of `node` from its expected position, in its own standard deviations.
double bend(const ValleyNode& node, const VectorXd& expected) {
  return lower_solve(node.root, VectorXd(node.others - expected)).norm();
}

// Appends nodes outwards from the first one; false if the valley is lost before it ends.
bool walk_out(ValleyWalk& walk, double unit, double side, double& most,
              std::vector<ValleyNode>& nodes) {
  double step = kFirstStep * unit;
  VectorXd slope;  // derivative of the others along the valley
  while (nodes.size() < kMostNodes) {
    const ValleyNode& last = nodes.back();
    ValleyNode next = last;
    next.at += side * step;
    if (slope.size() > 0) next.others += side * step * slope;
    const VectorXd expected = next.others;
    bool outside = false;
    const bool settled = walk.settle(next, outside);
    const bool smooth = settled && bend(next, expected) <= kMostBend &&
                        std::fabs(next.log_mass - last.log_mass) <= kMostFall;
    if (!smooth && step > kSmallestStep * unit) {
      step *= 0.5;
      continue;
    }
    if (outside) {  // a bound, or no solution beyond: keep the last segment
      nodes.push_back(last);
      nodes.back().at += side * step;
      return true;
    }
    if (!settled) return false;
    slope = (next.others - last.others) / (next.at - last.at);
    most = std::max(most, next.log_mass);
    const bool easy = bend(next, expected) < 0.3 * kMostBend;
    nodes.push_back(std::move(next));
    if (nodes.back().log_mass < most - kMaxLogMassDrop) return true;
    if (easy) step = std::min(1.6 * step, kLargestStep * unit);
  }
  return false;
}

}  // namespace

std::optional<Valley> trace_valley(LogDensity& density, const VectorXd& mode,
                                   const MatrixXd& covariance, Index along) {
  if (mode.size() < 2) return std::nullopt;
  ValleyWalk walk(density, mode, covariance, along);
  ValleyNode first = walk.start();
  bool outside = false;
  if (!walk.settle(first, outside)) return std::nullopt;
  const double unit = std::sqrt(covariance(along, along));
  double most = first.log_mass;
  std::vector<ValleyNode> up = {first}, down = {first};
  if (!walk_out(walk, unit, 1.0, most, up) || !walk_out(walk, unit, -1.0, most, down))
    return std::nullopt;
  std::vector<ValleyNode> nodes(down.rbegin(), down.rend());
  nodes.insert(nodes.end(), up.begin() + 1, up.end());
  return Valley(along, std::move(nodes));
}

}  // namespace shaker::estimator
